#include "base/files.h"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <csignal>

#include "base/lock.h"
#include "base/session_directory.h"
#include "tests/support/temporary_directory.h"

namespace opaline {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class FilesTest : public ::testing::Test {
 protected:
  testing::TemporaryDirectory directory_;
  std::filesystem::path path_ = directory_.path() / "file";
};

TEST_F(FilesTest, WritesWholeAndReplaces) {
  ASSERT_TRUE(write_whole(system_files(), path_, "first"));
  ASSERT_TRUE(write_whole(system_files(), path_, "2nd"));
  EXPECT_EQ(read_text(path_).value(), "2nd");
}

// A file-size limit stands for the full disk: the write fails half way, with EFBIG instead of
// ENOSPC.
TEST_F(FilesTest, LeavesTheOldFileAndNoPartialOneWhenAWriteFailsHalfWay) {
  ASSERT_TRUE(write_whole(system_files(), path_, "old"));
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);

  const std::string content(5000, 'x');
  const auto written = write_whole(system_files(), path_, content);
  const auto appended = system_files().append(path_, std::as_bytes(std::span(content)));

  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  ASSERT_FALSE(written);
  EXPECT_THAT(written.error().message, HasSubstr("write 5000 bytes to"));
  EXPECT_FALSE(appended);
  EXPECT_EQ(read_text(path_).value(), "old");
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory_.path()), {}), 1);
}

TEST_F(FilesTest, KeepsRoomForAFileWithoutMakingItLonger) {
  ASSERT_TRUE(write_whole(system_files(), path_, "begun"));
  ASSERT_TRUE(system_files().reserve(path_, 1u << 20));
  struct stat status {};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_size, 5);
  if (status.st_blocks * 512 < 1 << 20) GTEST_SKIP() << "the file system cannot";
  EXPECT_EQ(read_text(path_).value(), "begun");
}

TEST_F(FilesTest, RefusesAFileLongerThanTheLimit) {
  ASSERT_TRUE(write_whole(system_files(), path_, "12345"));
  EXPECT_TRUE(read_text(path_, 5));
  const auto refused = read_text(path_, 4);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

TEST_F(FilesTest, RefusesToReadAPipe) {
  ASSERT_EQ(::mkfifo(path_.c_str(), 0600), 0);
  const auto refused = read_text(path_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr(path_.string()));
}

// /dev/full is as full as a disk gets.
TEST_F(FilesTest, SaysWhatToDoWhenTheDiskIsFull) {
  std::filesystem::create_symlink("/dev/full", path_);
  const std::vector<std::byte> bytes(5000);
  for (const auto& failed :
       {system_files().append(path_, bytes), system_files().write(path_, bytes)}) {
    ASSERT_FALSE(failed);
    EXPECT_EQ(failed.error().code, ErrorCode::kUnavailable);
    EXPECT_THAT(failed.error().message,
                AllOf(HasSubstr("5000 bytes to " + path_.string()),
                      HasSubstr("No space left on device"),
                      HasSubstr("free some space and start again")));
  }
}

TEST_F(FilesTest, RemovesWhatWritesCutShortLeftBehind) {
  ASSERT_TRUE(system_files().make_directories(directory_.path() / "a"));
  const std::vector<std::byte> bytes(5);
  ASSERT_TRUE(system_files().write(directory_.path() / "a" / ".b.exr.partial", bytes));
  ASSERT_TRUE(system_files().write(directory_.path() / "a" / "b.exr.partial", bytes));
  ASSERT_TRUE(system_files().write(directory_.path() / ".c", bytes));
  remove_partial_files(system_files(), directory_.path());
  EXPECT_FALSE(std::filesystem::exists(directory_.path() / "a" / ".b.exr.partial"));
  EXPECT_TRUE(std::filesystem::exists(directory_.path() / "a" / "b.exr.partial"));
  EXPECT_TRUE(std::filesystem::exists(directory_.path() / ".c"));

  std::filesystem::create_directory(path_);  // nothing can be renamed to it
  EXPECT_FALSE(write_whole(system_files(), path_, "text"));
  EXPECT_FALSE(std::filesystem::exists(directory_.path() / ".file.partial"));
}

TEST_F(FilesTest, SaysWhichFileIsMissing) {
  const auto missing = read_text(path_);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(missing.error().message, HasSubstr(path_.string()));
}

TEST_F(FilesTest, LockExcludesASecondHolderAndIsSeenWithoutBeingTaken) {
  EXPECT_FALSE(FileLock::is_held(path_).value());
  {
    const auto held = FileLock::acquire(path_);
    ASSERT_TRUE(held);
    EXPECT_TRUE(FileLock::is_held(path_).value());
    const auto second = FileLock::acquire(path_);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::kBusy);
  }
  EXPECT_FALSE(FileLock::is_held(path_).value());
  EXPECT_TRUE(FileLock::acquire(path_));
}

TEST_F(FilesTest, LockIsMadeForEveryUserAndFollowsNoLink) {
  const mode_t before = ::umask(077);
  ASSERT_TRUE(FileLock::acquire(path_));
  ::umask(before);
  struct stat status {};
  ASSERT_EQ(::stat(path_.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0666u);

  const auto target = directory_.path() / "elsewhere";
  const auto link = directory_.path() / "link";
  std::filesystem::create_symlink(target, link);
  EXPECT_FALSE(FileLock::acquire(link));
  EXPECT_FALSE(std::filesystem::exists(target));
}

TEST_F(FilesTest, LockDiesWithItsProcess) {
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    const auto lock = FileLock::acquire(path_);
    if (!lock || ::write(ready[1], "x", 1) != 1) ::_exit(1);
    ::pause();
    ::_exit(0);
  }
  char byte = 0;
  ASSERT_EQ(::read(ready[0], &byte, 1), 1);
  EXPECT_TRUE(FileLock::is_held(path_).value());
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_FALSE(FileLock::is_held(path_).value());
}

TEST_F(FilesTest, SessionDirectoryIsMadeOnceAndOpensAgain) {
  const SessionDirectory::Contents contents{"wax", "a = 1\n", "b = 2\n", "c = 3\n"};
  ASSERT_TRUE(SessionDirectory::create(system_files(), path_, contents));
  const auto again = SessionDirectory::create(system_files(), path_, contents);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::kBusy);

  const auto session = SessionDirectory::open(path_);
  ASSERT_TRUE(session);
  EXPECT_EQ(session->name(), "wax");
  EXPECT_EQ(read_text(session->rig_toml()).value(), "b = 2\n");
}

TEST_F(FilesTest, SessionDirectoryOfANewerVersionIsRefusedAndLeftAlone) {
  ASSERT_TRUE(SessionDirectory::create(system_files(), path_, {"wax", "", "", ""}));
  const std::string newer = R"({"format": 2, "name": "wax"})";
  ASSERT_TRUE(write_whole(system_files(), path_ / "session.json", newer));
  const auto session = SessionDirectory::open(path_);
  ASSERT_FALSE(session);
  EXPECT_THAT(session.error().message, HasSubstr("newer version (format 2"));
  EXPECT_EQ(read_text(path_ / "session.json").value(), newer);
}

TEST_F(FilesTest, SessionDirectoryTellsANewerFormatFromADamagedOneAtAnyNumber) {
  ASSERT_TRUE(SessionDirectory::create(system_files(), path_, {"wax", "", "", ""}));
  for (const auto& [format, message] : {std::pair{"4294967297", "newer version (format 4294967297"},
                                        {"18446744073709551615", "newer version"},
                                        {"0", "damaged"},
                                        {"-1", "damaged"},
                                        {"1.5", "damaged"}}) {
    const std::string text = std::string(R"({"name": "wax", "format": )") + format + "}";
    ASSERT_TRUE(write_whole(system_files(), path_ / "session.json", text));
    const auto session = SessionDirectory::open(path_);
    ASSERT_FALSE(session) << format;
    EXPECT_THAT(session.error().message, HasSubstr(message));
  }
}

}  // namespace
}  // namespace opaline
