// The routes of viewfinders, over a stand-in for the program that shows the pictures.

#include "daemon/viewfinders.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <fstream>

#include "base/lock.h"
#include "daemon/jobs/station_lock.h"
#include "daemon/live_view.h"
#include "daemon/routes/viewfinders.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Child {
  std::optional<int> exit;
};

class FakeProcess : public JobProcess {
 public:
  explicit FakeProcess(std::shared_ptr<Child> child) : child_(std::move(child)) {}
  std::optional<int> poll_exit() override { return child_->exit; }
  std::optional<pid_t> pid() const override { return std::nullopt; }

 private:
  std::shared_ptr<Child> child_;
};

class FakeExecutor : public Executor {
 public:
  Result<std::unique_ptr<JobProcess>> start(const JobCommand& command) override {
    commands_.push_back(command);
    return std::unique_ptr<JobProcess>(std::make_unique<FakeProcess>(child_));
  }
  std::vector<JobCommand> commands_;
  std::shared_ptr<Child> child_ = std::make_shared<Child>();
};

class ViewfinderRoutes : public ::testing::Test {
 protected:
  ViewfinderRoutes() {
    ::setenv("OPALINE_LOCK_DIR", directory_.path().c_str(), 1);
    add_viewfinder_routes(router_, viewfinders_);
  }
  HttpResponse ask(const char* method, const char* target, const std::string& body = "") {
    HttpRequest request;
    request.method = method;
    request.path = *split_path(target);
    request.headers["content-type"] = "application/json";
    request.body = body;
    request.same_user = true;
    return router_.handle(request);
  }
  HttpResponse start() { return ask("POST", "/v1/viewfinders", R"({"rig":"demo"})"); }
  static nlohmann::json json_of(const HttpResponse& response) {
    return nlohmann::json::parse(response.body, nullptr, false);
  }
  /// What the program does once it has the station.
  void begin_showing() {
    auto lock = lock_station("demo");
    ASSERT_TRUE(lock) << lock.error().message;
    station_.emplace(*std::move(lock));
    auto live =
        LiveView::create(system_files(), live_directory(directory_.path() / "live", "demo"));
    ASSERT_TRUE(live) << live.error().message;
    live_ = *std::move(live);
  }
  void show(const std::string& picture, const char* by = "viewfinder") {
    ASSERT_TRUE(live_->show(std::as_bytes(std::span(picture)), {{"by", by}, {"focus", 0.5}}));
  }
  void end(int exit) {
    live_.reset();
    station_.reset();
    executor_.child_->exit = exit;
  }

  testing::TemporaryDirectory directory_;
  FakeExecutor executor_;
  Viewfinders viewfinders_{{directory_.path() / "live",
                            [](const std::string& rig, bool) -> Result<std::string> {
                              if (rig == "wrong") return invalid_argument("rig.toml:1:1: wrong");
                              return rig;
                            },
                            [this](const std::filesystem::path&) { return session_; }},
                           executor_,
                           system_files()};
  Router router_;
  std::string session_;
  std::optional<FileLock> station_;
  std::unique_ptr<LiveView> live_;
};

TEST_F(ViewfinderRoutes, StartsOneAndShowsWhatItSees) {
  const HttpResponse started = start();
  ASSERT_EQ(started.status, 202) << started.body;
  EXPECT_EQ(json_of(started)["state"], "starting");
  EXPECT_THAT(started.headers,
              ElementsAre(std::pair<std::string, std::string>("Location", "/v1/viewfinders/demo")));
  ASSERT_EQ(executor_.commands_.size(), 1U);
  EXPECT_EQ(executor_.commands_[0].stage, "calibrate");
  EXPECT_THAT(executor_.commands_[0].arguments,
              ElementsAre("--live", "--while-watched", "60", "--", HasSubstr("rig.toml")));

  begin_showing();
  show("PNG");
  const auto view = json_of(ask("GET", "/v1/viewfinders/demo"));
  EXPECT_EQ(view["state"], "running");
  EXPECT_EQ(view["focus"], 0.5);
  const HttpResponse picture = ask("GET", "/v1/viewfinders/demo/picture");
  EXPECT_EQ(picture.content_type, "image/png");
  EXPECT_EQ(picture.body, "PNG");
  EXPECT_THAT(ask("GET", "/v1/viewfinders/demo/page").body, HasSubstr("src=\"stream\""));
}

TEST_F(ViewfinderRoutes, RefusesAStationInUseAndSaysByWhom) {
  begin_showing();
  show("PNG", "calibration");
  EXPECT_EQ(start().status, 409);
  EXPECT_THAT(start().body, HasSubstr("is in use by a calibration"));
  live_.reset();
  session_ = "20260131-123456-ab12cd-demo";
  EXPECT_THAT(start().body, HasSubstr("is in use by session 20260131-123456-ab12cd-demo"));
  station_.reset();
  EXPECT_EQ(start().status, 202);
  EXPECT_EQ(start().status, 409) << "the first one is about to take the station";
}

TEST_F(ViewfinderRoutes, StreamsPicturesAndFiguresUntilItIsOver) {
  ASSERT_EQ(start().status, 202);
  begin_showing();
  show("first");
  const HttpResponse pictures = ask("GET", "/v1/viewfinders/demo/stream");
  const HttpResponse figures = ask("GET", "/v1/viewfinders/demo/events");
  ASSERT_NE(pictures.stream, nullptr);
  ASSERT_NE(figures.stream, nullptr);
  EXPECT_THAT(pictures.content_type, HasSubstr("boundary=opaline-view"));

  EXPECT_EQ(pictures.stream->next(),
            "--opaline-view\r\nContent-Type: image/png\r\nContent-Length: 5\r\n\r\nfirst\r\n");
  EXPECT_THAT(figures.stream->next(),
              AllOf(StartsWith("id: 1\nevent: view\n"), HasSubstr("\"focus\":0.5")));
  EXPECT_EQ(figures.stream->next(), "");
  show("second");
  EXPECT_THAT(pictures.stream->next(), HasSubstr("second"));
  EXPECT_THAT(figures.stream->next(), StartsWith("id: 2\n"));
  EXPECT_FALSE(figures.stream->is_over());

  show("third");
  end(0);
  EXPECT_THAT(pictures.stream->next(), AllOf(HasSubstr("third"), HasSubstr("--opaline-view--")));
  EXPECT_THAT(figures.stream->next(),
              AllOf(StartsWith("event: over"), HasSubstr("\"state\":\"over\"")));
  EXPECT_TRUE(pictures.stream->is_over());
  EXPECT_TRUE(figures.stream->is_over());
}

TEST_F(ViewfinderRoutes, LookingKeepsItRunningAndDeleteEndsIt) {
  ASSERT_EQ(start().status, 202);
  begin_showing();
  show("PNG");
  const auto watched = live_->directory() / "watched";
  std::filesystem::last_write_time(
      watched, std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_FALSE(live_->is_watched(std::chrono::seconds(60)));
  EXPECT_TRUE(testing::eventually([&] {  // a look in a second counts
    return ask("GET", "/v1/viewfinders/demo/picture").status == 200 &&
           live_->is_watched(std::chrono::seconds(60));
  }));

  EXPECT_EQ(ask("DELETE", "/v1/viewfinders/demo").status, 202);
  EXPECT_FALSE(live_->is_watched(std::chrono::seconds(60)));
  EXPECT_EQ(ask("GET", "/v1/viewfinders/demo").status, 200);
  EXPECT_FALSE(live_->is_watched(std::chrono::seconds(60))) << "looking does not undo it";
  end(0);
  EXPECT_EQ(ask("DELETE", "/v1/viewfinders/demo").status, 409);
}

TEST_F(ViewfinderRoutes, SaysWhyOneFailed) {
  ASSERT_EQ(start().status, 202);
  std::ofstream(live_directory(directory_.path() / "live", "demo") / "job.log")
      << "camera: unplugged\n";
  end(1);
  const auto view = json_of(ask("GET", "/v1/viewfinders/demo"));
  EXPECT_EQ(view["state"], "failed");
  EXPECT_EQ(view["message"], "camera: unplugged\n");
}

TEST_F(ViewfinderRoutes, HandsAnOperatorsAnswerToACalibration) {
  begin_showing();
  show("PNG");
  EXPECT_EQ(ask("POST", "/v1/viewfinders/demo/answer", R"({"answer":"take"})").status, 409);
  show("PNG", "calibration");
  EXPECT_EQ(ask("POST", "/v1/viewfinders/demo/answer", R"({"answer":"what"})").status, 400);
  EXPECT_EQ(ask("POST", "/v1/viewfinders/demo/answer", R"({"answer":"enough"})").status, 202);
  EXPECT_EQ(live_->take_answer(), "enough");
  EXPECT_EQ(live_->take_answer(), "");
  EXPECT_EQ(ask("DELETE", "/v1/viewfinders/demo").status, 409);
}

TEST_F(ViewfinderRoutes, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(ask("GET", "/v1/viewfinders/demo").status, 404);
  EXPECT_EQ(ask("GET", "/v1/viewfinders/demo/stream").status, 404);
  EXPECT_EQ(ask("GET", "/v1/viewfinders/..").status, 404);
  EXPECT_EQ(ask("POST", "/v1/viewfinders", "[]").status, 400);
  EXPECT_EQ(ask("POST", "/v1/viewfinders", R"({"rig":"a","more":1})").status, 400);
  const HttpResponse wrong = ask("POST", "/v1/viewfinders", R"({"rig":"wrong"})");
  EXPECT_EQ(wrong.status, 400);
  EXPECT_THAT(wrong.body, HasSubstr("rig.toml:1:1"));
  EXPECT_TRUE(executor_.commands_.empty());
}

}  // namespace
}  // namespace opaline::daemon
