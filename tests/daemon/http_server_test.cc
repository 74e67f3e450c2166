#include "daemon/http_server.h"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <atomic>
#include <stdexcept>
#include <thread>

#include "base/unix_socket.h"
#include "tests/support/process.h"
#include "tests/support/raw_http.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

using testing::connect_tcp;
using testing::converse;
using testing::eventually;
using testing::HttpReply;
using testing::parse_reply;
using testing::request_text;

/// Goes on for ever, a megabyte at a time; counts itself.
class EndlessStream : public TextStream {
 public:
  explicit EndlessStream(std::atomic<int>& count) : count_(count) { ++count_; }
  ~EndlessStream() override { --count_; }
  EndlessStream(const EndlessStream&) = delete;
  EndlessStream& operator=(const EndlessStream&) = delete;
  std::string next() override { return std::string(1u << 20, 'x'); }
  bool is_over() const override { return false; }

 private:
  std::atomic<int>& count_;
};

class HttpServerTest : public ::testing::Test {
 protected:
  void TearDown() override {
    if (server_ != nullptr) server_->stop();
  }
  void serve() {
    options_.port = 0;
    options_.socket = root_.path() / "socket";
    auto server = HttpServer::listen(options_, [this](const HttpRequest& r) { return answer(r); });
    ASSERT_TRUE(server) << server.error().message;
    server_ = *std::move(server);
    thread_ = std::jthread([this] { server_->run(); });
  }
  HttpReply ask(const std::string& target) const {
    return parse_reply(converse(connect_tcp(server_->port()), request_text("GET", target)));
  }

  testing::TemporaryDirectory root_;
  HttpServer::Options options_;
  std::atomic<int> streams_ = 0;
  std::unique_ptr<HttpServer> server_;

 private:
  HttpResponse answer(const HttpRequest& request) {
    if (request.path.at(0) == "throw") throw std::runtime_error("thrown");
    HttpResponse response;
    if (request.path.at(0) == "stream") response.stream = std::make_unique<EndlessStream>(streams_);
    return response;
  }
  std::jthread thread_;
};

TEST_F(HttpServerTest, AnswersAHandlersExceptionWith500AndGoesOn) {
  serve();
  EXPECT_EQ(ask("/throw").status, 500);
  EXPECT_EQ(ask("/").status, 200);
}

TEST_F(HttpServerTest, AnswersARequestThatDoesNotComeInTimeWith408) {
  options_.read_deadline = std::chrono::seconds(1);
  serve();

  EXPECT_EQ(parse_reply(converse(connect_tcp(server_->port()), "GET / HTTP/1.1\r\n")).status, 408);
}

TEST_F(HttpServerTest, LetsGoOfAClientThatDoesNotTakeItsAnswer) {
  options_.write_deadline = std::chrono::seconds(1);
  serve();
  const FileDescriptor idle = connect_tcp(server_->port());
  const std::string request = request_text("GET", "/stream");
  ASSERT_EQ(::send(idle.get(), request.data(), request.size(), 0),
            static_cast<ssize_t>(request.size()));
  ASSERT_TRUE(eventually([&] { return streams_ == 1; }));

  EXPECT_TRUE(eventually([&] { return streams_ == 0; }));
}

TEST_F(HttpServerTest, RefusesOneStreamTooMany) {
  options_.max_streams = 1;
  serve();
  const FileDescriptor first = connect_tcp(server_->port());
  const std::string request = request_text("GET", "/stream");
  ASSERT_EQ(::send(first.get(), request.data(), request.size(), 0),
            static_cast<ssize_t>(request.size()));
  char byte = 0;
  ASSERT_EQ(::recv(first.get(), &byte, 1, 0), 1);

  EXPECT_EQ(ask("/stream").status, 503);
  EXPECT_EQ(ask("/").status, 200);
}

TEST_F(HttpServerTest, LetsConnectionsOverTcpWaitAndKeepsSomeForTheUnixSocket) {
  options_.max_connections = 4;
  serve();
  std::vector<FileDescriptor> silent;
  for (int i = 0; i < 3; ++i) silent.push_back(connect_tcp(server_->port()));
  std::atomic<int> late = 0;
  std::jthread waits([&] { late = ask("/").status; });

  for (int i = 0; i < 5; ++i) {
    const auto own = connect_unix(root_.path() / "socket");
    ASSERT_TRUE(own);
    EXPECT_EQ(parse_reply(converse(*own, request_text("GET", "/"))).status, 200);
  }
  EXPECT_EQ(late, 0);
  silent.clear();
  waits.join();

  EXPECT_EQ(late, 200);
}

}  // namespace
}  // namespace opaline::daemon
