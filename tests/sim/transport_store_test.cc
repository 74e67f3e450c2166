#include "sim/transport_store.h"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "base/io/transport_io.h"
#include "base/lock.h"
#include "tests/support/temporary_directory.h"

namespace opaline::sim {
namespace {

SceneOptions tiny_scene() {
  return {.kind = SceneKind::kWax, .seed = 3, .block = {4, 4, 3, 1.0, 1.0, 1.0}};
}

ResponseOptions tiny_options() {
  return {.patches_x = 2,
          .patches_y = 1,
          .camera_centre = camera_above(tiny_scene().block, 100.0, 10.0),
          .photons_per_patch = 1};
}

/// Counts how often a computation reported.
class CountingSink : public NullSink {
 public:
  void progress(const Progress& /*progress*/) override { ++reports; }
  int reports = 0;
};

class TransportStore : public ::testing::Test {
 protected:
  Result<TransportResponses> load(const ResponseOptions& options = tiny_options()) {
    events_.reports = 0;
    return load_or_compute(tiny_scene(), options, store_, events_, {});
  }
  bool computed() const { return events_.reports > 0; }
  std::filesystem::path cached() const {
    return cache_file(store_, transport_key(tiny_scene(), tiny_options()));
  }

  opaline::testing::TemporaryDirectory directory_;
  StoreOptions store_{.committed = {}, .cache = directory_.path() / "cache"};
  CountingSink events_;
};

TEST_F(TransportStore, ComputesOnceAndThenReadsTheSame) {
  const auto first = load();
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_TRUE(computed());
  EXPECT_EQ(first->patches.size(), 2);
  EXPECT_EQ(*scene_from_json(first->scene), tiny_scene());
  const auto second = load();
  ASSERT_TRUE(second);
  EXPECT_FALSE(computed());
  EXPECT_EQ(second->patch(1, 0).radiance, first->patch(1, 0).radiance);
}

TEST_F(TransportStore, ComputesADamagedCacheFileAgain) {
  ASSERT_TRUE(load());
  std::filesystem::resize_file(cached(), 200);
  ASSERT_TRUE(load());
  EXPECT_TRUE(computed());
  EXPECT_TRUE(read_transport(cached()));
}

TEST_F(TransportStore, TakesACommittedFileThatServes) {
  const auto computed_once = load();
  store_.committed = directory_.path() / "committed.transport";
  std::filesystem::rename(cached(), store_.committed);
  const auto loaded = load();
  ASSERT_TRUE(loaded);
  EXPECT_FALSE(computed());
  ResponseOptions other_camera = tiny_options();
  other_camera.camera_centre.x += 1.0;
  ASSERT_TRUE(load(other_camera));
  EXPECT_TRUE(computed());
  ResponseOptions more_photons = tiny_options();
  more_photons.photons_per_patch = 9 * kBatchPhotons;
  ASSERT_TRUE(load(more_photons));
  EXPECT_TRUE(computed());
}

TEST_F(TransportStore, TakesNoCommittedFileOfAnotherMethod) {
  auto responses = load();
  ASSERT_TRUE(responses);
  std::filesystem::remove(cached());
  responses->generator = "a fast approximation";
  store_.committed = directory_.path() / "committed.transport";
  ASSERT_TRUE(write_transport(system_files(), store_.committed, *responses));
  const auto loaded = load();
  ASSERT_TRUE(loaded);
  EXPECT_TRUE(computed());
  EXPECT_EQ(loaded->generator, transport_generator());
}

TEST_F(TransportStore, ReturnsWhatItComputedThoughTheCacheCannotBeWritten) {
  std::ofstream(store_.cache) << "a file where the directory should be";
  const auto loaded = load();
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_TRUE(computed());
  EXPECT_EQ(loaded->patches.size(), 2);
}

TEST_F(TransportStore, RefusesADamagedCommittedFile) {
  store_.committed = directory_.path() / "committed.transport";
  std::ofstream(store_.committed) << "opaline transport 1\n{";
  EXPECT_EQ(load().error().code, ErrorCode::kInvalidArgument);
}

TEST_F(TransportStore, WaitsForWhoeverComputesTheSameAndStopsWhenAsked) {
  std::filesystem::create_directories(store_.cache);
  const auto lock = FileLock::acquire(cached().string() + ".lock");
  ASSERT_TRUE(lock);
  std::stop_source stop;
  class StopWhenWaiting : public NullSink {
   public:
    explicit StopWhenWaiting(std::stop_source& stop) : stop_(stop) {}
    void progress(const Progress& progress) override {
      if (progress.detail.contains("waiting")) stop_.request_stop();
    }

   private:
    std::stop_source& stop_;
  } events(stop);
  const auto stopped =
      load_or_compute(tiny_scene(), tiny_options(), store_, events, stop.get_token());
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

TEST(TransportKey, ChangesWithWhatMattersAndOnlyWithThat) {
  const std::string key = transport_key(tiny_scene(), tiny_options());
  ResponseOptions options = tiny_options();
  options.threads = 7;
  options.photons_per_patch = 2;  // the same number of whole batches
  EXPECT_EQ(transport_key(tiny_scene(), options), key);
  options.seed = 2;
  EXPECT_NE(transport_key(tiny_scene(), options), key);
  SceneOptions scene = tiny_scene();
  scene.ior = 1.31;
  EXPECT_NE(transport_key(scene, tiny_options()), key);
}

TEST(CombinedResponses, AverageRunsWithSeedsInSequence) {
  const auto material = make_material(tiny_scene());
  NullSink events;
  std::vector<TransportResponses> runs;
  for (const std::uint64_t seed : {4, 5, 6}) {
    ResponseOptions options = tiny_options();
    options.seed = seed;
    runs.push_back(*compute_responses(*material, options, "", events, {}));
  }
  const auto two = combine(runs[0], runs[1]);
  ASSERT_TRUE(two);
  const auto three = combine(*two, runs[2]);
  ASSERT_TRUE(three);
  EXPECT_EQ(three->seed, 4);
  EXPECT_EQ(three->passes, 3);
  EXPECT_EQ(three->photons_per_patch, std::uint64_t{24} * kBatchPhotons);
  const auto at = [](const TransportResponses& r) { return r.patch(0, 0).radiance.at(1, 2, 1); };
  const auto variance = [](const TransportResponses& r) {
    return r.patch(0, 0).variance.at(1, 2, 1);
  };
  EXPECT_FLOAT_EQ(at(*three), (at(runs[0]) + at(runs[1]) + at(runs[2])) / 3);
  EXPECT_FLOAT_EQ(variance(*three),
                  (variance(runs[0]) + variance(runs[1]) + variance(runs[2])) / 9);
  EXPECT_FALSE(combine(runs[0], runs[2]));
  EXPECT_FALSE(combine(*two, runs[1]));
}

}  // namespace
}  // namespace opaline::sim
