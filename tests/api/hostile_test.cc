// What the daemon does with requests that it should not serve.

#include <gmock/gmock.h>

#include "tests/api/opalined_fixture.h"

namespace opaline::testing {
namespace {

using ::testing::HasSubstr;

class Hostile : public OpalinedTest {
 protected:
  HttpReply send(const std::string& bytes) const {
    return parse_reply(converse(connect_tcp(port()), bytes));
  }
};

TEST_F(Hostile, AnswersWhatIsNotHttpAndGoesOn) {
  start();
  EXPECT_EQ(send("what is this\r\n\r\n").status, 400);
  EXPECT_EQ(send(std::string("GET /\0 HTTP/1.1\r\n\r\n", 19)).status, 400);
  EXPECT_EQ(send("GET %zz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").status, 400);
  EXPECT_EQ(
      send("POST /v1/sessions HTTP/1.1\r\nHost: localhost\r\nContent-Length: -1\r\n\r\n").status,
      400);
  EXPECT_EQ(ask("GET", "/healthz").status, 200);
}

TEST_F(Hostile, RefusesWhatIsTooLarge) {
  start();
  const std::string long_header = "X-Long: " + std::string(10000, 'x') + "\r\n";
  EXPECT_EQ(ask_tcp("GET", "/healthz", "", long_header).status, 431);
  EXPECT_EQ(ask_tcp("POST", "/v1/sessions", std::string((1 << 20) + 1, ' ')).status, 413);
}

TEST_F(Hostile, RefusesUnknownPathsAndMethods) {
  start();
  EXPECT_EQ(ask("GET", "/nothing").status, 404);
  EXPECT_EQ(ask("GET", "/v1/sessions/20260101-000000-aaaaaa-none").status, 404);
  const HttpReply put = ask("PUT", "/v1/sessions");
  EXPECT_EQ(put.status, 405);
  EXPECT_EQ(put.headers.at("allow"), "POST, GET, HEAD");
  EXPECT_EQ(put.headers.at("content-type"), "application/problem+json");
}

TEST_F(Hostile, LetsNobodyOutOfTheSessionsDirectory) {
  start();
  const std::string id = create();
  ASSERT_TRUE(becomes(id, "succeeded"));
  std::ofstream(root_.path() / "secret") << "secret";
  std::filesystem::create_symlink(root_.path() / "secret", sessions_ / id / "link.html");
  std::filesystem::create_directory_symlink(root_.path(), sessions_ / id / "links");
  const std::string artefacts = "/v1/sessions/" + id + "/artefacts/";

  for (const char* name : {"../../secret",
                           "..%2f..%2fsecret",
                           "%2e%2e/%2e%2e/secret",
                           "link.html",
                           "links/secret",
                           "/etc/passwd",
                           "%2fetc%2fpasswd",
                           ".",
                           "",
                           "lock",
                           "preview.html%00.png"}) {
    const HttpReply reply = ask("GET", artefacts + name);
    EXPECT_TRUE(reply.status == 404 || reply.status == 400) << name << ": " << reply.status;
  }
  for (const char* other : {"..", "%2e%2e", "..%2f", ".catalogue.sqlite", "%00"}) {
    const HttpReply reply = ask("GET", "/v1/sessions/" + std::string(other) + "/artefacts/secret");
    EXPECT_TRUE(reply.status == 404 || reply.status == 400) << other << ": " << reply.status;
  }
}

TEST_F(Hostile, RefusesBadConfigurationsWithTheirPlace) {
  start();
  const auto detail = [&](const nlohmann::json& body) {
    const HttpReply reply = ask("POST", "/v1/sessions", body.dump());
    EXPECT_EQ(reply.status, 400) << body;
    return reply.json().value("detail", "");
  };
  EXPECT_THAT(detail({{"session", "name = \nx"}, {"rig", ""}}), HasSubstr("session.toml:1:"));
  EXPECT_THAT(detail({{"session", "nmae = \"x\""}, {"rig", ""}}), HasSubstr("nmae"));
  EXPECT_THAT(detail({{"path", "/etc/passwd"}}), HasSubstr("\"path\""));
  EXPECT_THAT(detail("text"), HasSubstr("not a JSON object"));
  EXPECT_EQ(ask("POST", "/v1/sessions", "{").status, 400);
  EXPECT_TRUE(ask("GET", "/v1/sessions").json()["sessions"].empty());
}

TEST_F(Hostile, LetsOnlyItsOwnUserNameFiles) {
  start();
  const HttpReply reply = ask_tcp("POST", "/v1/sessions", wish());

  EXPECT_EQ(reply.status, 400);
  EXPECT_THAT(reply.body, HasSubstr("only requests over the Unix socket may"));
}

TEST_F(Hostile, RefusesOtherSitesPages) {
  start();
  EXPECT_EQ(ask_tcp("GET", "/v1/sessions", "", "Host: evil.example\r\n").status, 403);
  EXPECT_EQ(ask_tcp("GET", "/v1/sessions", "", "Origin: http://evil.example\r\n").status, 403);
  EXPECT_EQ(ask_tcp("GET", "/v1/sessions", "", "Host: 127.0.0.1:80\r\n").status, 200);
}

TEST_F(Hostile, AsksForTheTokenWhenThereIsOne) {
  start({"--token-file", token_file()});

  EXPECT_EQ(ask_tcp("GET", "/v1/sessions").status, 401);
  EXPECT_EQ(ask_tcp("GET", "/v1/sessions", "", "Authorization: Bearer 0123456789abcdeg\r\n").status,
            401);
  EXPECT_EQ(ask_tcp("GET", "/v1/sessions", "", "Authorization: Bearer 0123456789abcdef\r\n").status,
            200);
}

TEST_F(Hostile, ListensToOthersOnlyWithAToken) {
  const auto daemon = spawn(
      "opalined", {"--sessions", sessions_.string(), "--listen", "0.0.0.0", "--port", "0"}, "out");
  EXPECT_EQ(daemon->wait(), 2);
  EXPECT_THAT(daemon->output(), HasSubstr("token"));
}

TEST_F(Hostile, ListensToOthersWithAToken) {
  start({"--listen", "0.0.0.0", "--token-file", token_file()});
  const std::string foreign = "Host: station.example\r\n";

  EXPECT_EQ(ask_tcp("GET", "/v1/sessions", "", foreign).status, 401);
  EXPECT_EQ(
      ask_tcp("GET", "/v1/sessions", "", foreign + "Authorization: Bearer 0123456789abcdef\r\n")
          .status,
      200);
}

TEST_F(Hostile, RefusesATokenThatOthersCanRead) {
  const std::string file = token_file();
  std::filesystem::permissions(file, std::filesystem::perms(0644));
  const auto daemon = spawn(
      "opalined", {"--sessions", sessions_.string(), "--port", "0", "--token-file", file}, "out");

  EXPECT_EQ(daemon->wait(), 2);
  EXPECT_THAT(daemon->output(), HasSubstr("chmod 600"));
}

TEST_F(Hostile, ServesItsOwnUserWhileManyConnectionsSayNothing) {
  start();
  std::vector<FileDescriptor> silent;
  for (int i = 0; i < 40; ++i) silent.push_back(connect_tcp(port()));
  EXPECT_EQ(ask_tcp("GET", "/healthz").status, 200);
  for (int i = 0; i < 60; ++i) silent.push_back(connect_tcp(port()));

  EXPECT_EQ(ask("GET", "/healthz").status, 200);

  silent.clear();
  EXPECT_EQ(ask_tcp("GET", "/healthz").status, 200);
}

TEST_F(Hostile, AnswersHeadAsGetWithoutTheBody) {
  start();
  const HttpReply get = ask("GET", "/v1/sessions");
  const HttpReply head = ask("HEAD", "/v1/sessions");

  EXPECT_EQ(head.status, 200);
  EXPECT_EQ(head.headers, get.headers);
  EXPECT_EQ(head.body, "");
}

}  // namespace
}  // namespace opaline::testing
