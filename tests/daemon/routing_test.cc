#include <gtest/gtest.h>

#include "daemon/http_access.h"
#include "daemon/problem.h"
#include "daemon/router.h"
#include "daemon/session_factory.h"

namespace opaline::daemon {
namespace {

TEST(Router, HandsTheHandlerWhatThePatternNames) {
  Router router;
  router.add(
      "GET", "/v1/{id}/files/{name...}", [](const HttpRequest&, const Router::Parameters& p) {
        HttpResponse response;
        response.body = p[0] + "|" + p[1];
        return response;
      });
  HttpRequest request;
  request.method = "GET";
  request.path = *split_path("/v1/a%20b/files/x/y.png");

  EXPECT_EQ(router.handle(request).body, "a b|x/y.png");
  request.path = *split_path("/v1/a/files");
  EXPECT_EQ(router.handle(request).status, 404);
}

TEST(Router, DecodesPathsAndRefusesHiddenSlashes) {
  EXPECT_EQ(split_path("/a/%2e%2E")->at(1), "..");
  EXPECT_FALSE(split_path("/a%2fb"));
  EXPECT_FALSE(split_path("/a%00"));
  EXPECT_FALSE(split_path("/a%g0"));
  EXPECT_FALSE(split_path("/a%2"));
  EXPECT_FALSE(split_path("http://host/a"));
  EXPECT_EQ(split_query("since=7&x=%20&broken=%"),
            (std::map<std::string, std::string>{{"since", "7"}, {"x", " "}}));
}

TEST(SessionId, IsMadeFromAnyNameAndIsSafe) {
  for (const char* name : {"Blue Wax #2", "", "../../etc", "äöü", "----"}) {
    EXPECT_TRUE(is_session_id(new_session_id(name))) << name;
  }
  EXPECT_TRUE(new_session_id("Blue Wax #2").ends_with("-blue-wax-2"));
  for (const char* bad : {"", "..", "a/b", "A", ".a", "-a"})
    EXPECT_FALSE(is_session_id(bad)) << bad;
  EXPECT_FALSE(is_session_id(std::string(81, 'a')));
}

TEST(Access, IsForLoopbackNamesOnly) {
  HttpRequest request;
  for (const char* good : {"localhost", "localhost:8787", "127.0.0.1:1", "[::1]:8787", "[::1]"}) {
    request.headers["host"] = good;
    EXPECT_FALSE(refuse(request, "")) << good;
  }
  for (const char* bad : {"", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example"}) {
    request.headers["host"] = bad;
    EXPECT_TRUE(refuse(request, "")) << bad;
  }
}

TEST(Problem, MapsEveryCodeToItsStatus) {
  EXPECT_EQ(problem(invalid_argument("")).status, 400);
  EXPECT_EQ(problem(not_found("")).status, 404);
  EXPECT_EQ(problem(busy("")).status, 409);
  EXPECT_EQ(problem(unavailable("")).status, 503);
  EXPECT_EQ(problem(timeout("")).status, 504);
  EXPECT_EQ(problem(internal_error("")).status, 500);
}

}  // namespace
}  // namespace opaline::daemon
