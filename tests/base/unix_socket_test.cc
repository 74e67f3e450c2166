#include "base/unix_socket.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/socket.h>

#include <thread>
#include <vector>

#include "base/files.h"
#include "tests/support/temporary_directory.h"

namespace opaline {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class UnixSocketTest : public ::testing::Test {
 protected:
  /// A server that takes none of its connections, and the many who wait for it.
  void serve_nobody() {
    listener_ = *listen_unix(path_);
    for (int i = 0; i < 64; ++i) {
      auto connection = connect_unix(path_, 0ns);
      if (!connection) break;
      waiting_.push_back(*std::move(connection));
    }
    ASSERT_LT(waiting_.size(), 64u);
  }

  testing::TemporaryDirectory directory_;
  std::filesystem::path path_ = directory_.path() / "a.sock";
  FileDescriptor listener_;
  std::vector<FileDescriptor> waiting_;
};

TEST_F(UnixSocketTest, ConnectsOnANameOfAnyLength) {
  path_ = directory_.path() / std::string(90, 'd') / "a.sock";
  ASSERT_TRUE(system_files().make_directories(path_.parent_path()));
  ASSERT_GT(path_.string().size(), 107u);
  const auto listener = listen_unix(path_);
  ASSERT_TRUE(listener) << listener.error().message;
  const auto connection = connect_unix(path_);
  ASSERT_TRUE(connection) << connection.error().message;
  EXPECT_EQ(::fcntl(connection->get(), F_GETFL) & O_NONBLOCK, 0);
  EXPECT_GE(::accept(listener->get(), nullptr, nullptr), 0);
}

TEST_F(UnixSocketTest, ListensInPlaceOfAnOldSocket) {
  ASSERT_TRUE(listen_unix(path_));
  EXPECT_FALSE(connect_unix(path_));
  const auto listener = listen_unix(path_);
  ASSERT_TRUE(listener) << listener.error().message;
  EXPECT_TRUE(connect_unix(path_));
}

TEST_F(UnixSocketTest, LeavesAloneWhatIsNoSocket) {
  ASSERT_TRUE(write_whole(system_files(), path_, "thesis"));
  const auto listener = listen_unix(path_);
  ASSERT_FALSE(listener);
  EXPECT_EQ(listener.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(listener.error().message, HasSubstr(path_.string()));
  EXPECT_EQ(read_text(path_).value(), "thesis");
}

TEST_F(UnixSocketTest, SaysWhenAServerTakesNoConnection) {
  serve_nobody();
  const auto connection = connect_unix(path_, 30ms);
  ASSERT_FALSE(connection);
  EXPECT_EQ(connection.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(connection.error().message, HasSubstr(path_.string()));
}

TEST_F(UnixSocketTest, StopsWaitingForAServerWhenAsked) {
  serve_nobody();
  std::stop_source stop;
  std::jthread stopper([&] { stop.request_stop(); });
  const auto connection = connect_unix(path_, 1h, stop.get_token());
  ASSERT_FALSE(connection);
  EXPECT_EQ(connection.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace opaline
