#include "daemon/session_history.h"

#include <gtest/gtest.h>

namespace opaline::daemon {
namespace {

/// A log written by hand.
class History {
 public:
  History& started(const char* job) { return add("job.started", {{"job", job}}); }
  History& finished(const char* job, const char* outcome, nlohmann::json more = {}) {
    nlohmann::json data{{"job", job}, {"outcome", outcome}};
    if (more.is_object()) data.update(more);
    return add("job.finished", data);
  }
  History& done(const char* job) { return started(job).finished(job, "succeeded"); }
  History& add(const char* type, const nlohmann::json& data = nlohmann::json::object()) {
    history_.apply({++seq_, "", type, data});
    return *this;
  }
  History& cancel_wished() {
    wished_ = true;
    return *this;
  }
  Decision dead() const { return decide(history_, false, wished_); }
  Decision alive() const { return decide(history_, true, wished_); }
  const SessionHistory& get() const { return history_; }

 private:
  SessionHistory history_;
  std::uint64_t seq_ = 0;
  bool wished_ = false;
};

TEST(SessionHistory, OfAnEmptyLogStartsTheFirstStage) {
  const Decision decision = History().dead();

  EXPECT_EQ(decision.state, SessionState::kQueued);
  EXPECT_EQ(decision.action, Action::kStart);
  EXPECT_EQ(kStages[decision.stage], "capture");
}

TEST(SessionHistory, GoesThroughTheStagesInOrder) {
  History history;
  history.done("capture");
  EXPECT_EQ(kStages[history.dead().stage], "reconstruct");
  history.done("reconstruct");
  EXPECT_EQ(kStages[history.dead().stage], "preview");
  history.done("preview");
  EXPECT_EQ(history.dead().state, SessionState::kSucceeded);
  EXPECT_EQ(history.dead().action, Action::kNone);
}

TEST(SessionHistory, LeavesARunningJobAlone) {
  const Decision decision = History().done("capture").started("reconstruct").alive();

  EXPECT_EQ(decision.state, SessionState::kRunning);
  EXPECT_EQ(decision.action, Action::kNone);
  EXPECT_EQ(kStages[decision.stage], "reconstruct");
}

TEST(SessionHistory, StartsAgainWhatDiedWithoutAWord) {
  const Decision decision = History().started("capture").dead();

  EXPECT_EQ(decision.action, Action::kStart);
  EXPECT_EQ(kStages[decision.stage], "capture");
}

TEST(SessionHistory, GivesUpAfterThreeFruitlessRuns) {
  History history;
  history.started("capture").started("capture");
  EXPECT_EQ(history.dead().action, Action::kStart);
  history.started("capture").add("progress", {{"step", "x"}});  // progress is no work done
  EXPECT_EQ(history.dead().action, Action::kGiveUp);
}

TEST(SessionHistory, GoesOnForEverWhileEachRunGetsSomewhere) {
  History history;
  for (int i = 0; i < 50; ++i) history.started("capture").add("region.captured");

  EXPECT_EQ(history.dead().action, Action::kStart);
}

TEST(SessionHistory, CountsAPlanThatEachRunLogsAsNoWorkDone) {
  History history;
  for (int i = 0; i < 3; ++i) history.started("capture").add("capture.planned");

  EXPECT_EQ(history.dead().action, Action::kGiveUp);
}

TEST(SessionHistory, CountsARunThatASignalEndedNeitherWay) {
  History history;
  for (int i = 0; i < 5; ++i) {
    history.started("capture").finished("capture", "cancelled", {{"by", "signal"}});
  }
  EXPECT_EQ(history.dead().action, Action::kStart);
  history.started("capture").started("capture").started("capture");
  EXPECT_EQ(history.dead().action, Action::kGiveUp);
}

TEST(SessionHistory, CountsACheckpointAsWorkDone) {
  History history;
  history.done("capture");
  for (int i = 0; i < 9; ++i) history.started("reconstruct").add("checkpoint.saved");

  EXPECT_EQ(history.dead().action, Action::kStart);
}

TEST(SessionHistory, EndsWithAStageThatFailed) {
  History history;
  history.started("capture").finished("capture", "failed", {{"message", "too dark"}});

  EXPECT_EQ(history.dead().state, SessionState::kFailed);
  EXPECT_EQ(history.dead().action, Action::kNone);
  EXPECT_EQ(history.get().stages()[0].message, "too dark");
}

TEST(SessionHistory, TriesAgainWhatFoundItsStationInUse) {
  const Decision decision =
      History().started("capture").finished("capture", "failed", {{"code", "busy"}}).dead();

  EXPECT_EQ(decision.action, Action::kStart);
}

TEST(SessionHistory, EndsWhenAPersonCancelsAndGoesOnAfterASignal) {
  History person;
  person.started("capture").finished("capture", "cancelled", {{"by", "request"}});
  History machine;
  machine.started("capture").finished("capture", "cancelled", {{"by", "signal"}});

  EXPECT_EQ(person.dead().state, SessionState::kCancelled);
  EXPECT_EQ(machine.dead().action, Action::kStart);
}

TEST(SessionHistory, RemembersAWishToCancelOfAJobThatDiedBeforeItCouldStop) {
  History history;
  history.started("capture").add("job.cancel_requested", {{"job", "capture"}});

  EXPECT_EQ(history.alive().state, SessionState::kCancelling);
  EXPECT_EQ(history.dead().action, Action::kCloseCancel);
  history.add("session.cancelled");
  EXPECT_EQ(history.dead().state, SessionState::kCancelled);
}

TEST(SessionHistory, FollowsAWishToCancelUnlessTheSessionIsOver) {
  EXPECT_EQ(History().cancel_wished().dead().action, Action::kCloseCancel);
  EXPECT_EQ(History().started("capture").cancel_wished().alive().state, SessionState::kCancelling);
  History over;
  over.done("capture").done("reconstruct").done("preview").cancel_wished();
  EXPECT_EQ(over.dead().state, SessionState::kSucceeded);
}

TEST(SessionHistory, ResumesWhatFailedAndKeepsWhatWasDone) {
  History history;
  history.done("capture").started("reconstruct").finished("reconstruct", "failed");
  history.add("session.resumed");

  EXPECT_EQ(history.dead().action, Action::kStart);
  EXPECT_EQ(kStages[history.dead().stage], "reconstruct");
}

}  // namespace
}  // namespace opaline::daemon
