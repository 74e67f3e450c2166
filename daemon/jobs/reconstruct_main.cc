#include <fmt/format.h>

#include "base/clock.h"
#include "base/io/dataset_io.h"
#include "base/io/volume_io.h"
#include "config/session_config.h"
#include "daemon/jobs/job.h"
#include "daemon/jobs/version.h"
#include "reconstruct/back_end.h"
#include "reconstruct/inverse_solver.h"
#include "reconstruct/summary.h"

namespace opaline::daemon {
namespace {

Result<void> reconstruct_session(JobContext& job) {
  const auto config = config::load_resolved(job.session);
  if (!config) return config.error();
  const auto dataset = read_dataset(job.session.path());
  if (!dataset) return dataset.error().in("dataset");
  const reconstruct::InverseOptions& options = config->reconstruction;
  const auto solver = reconstruct::make_solver(options);
  if (!solver) return solver.error();
  const SystemClock clock;
  const reconstruct::CheckpointStore checkpoints(
      job.files, job.session.checkpoint(), reconstruct::fingerprint(*dataset, options));
  auto result = reconstruct::reconstruct_material(
      *dataset, options, {**solver, job.events, clock, &checkpoints}, job.stop);
  if (!result) return result.error();
  result->material.name = config->sample_name;
  auto written = write_material(job.files,
                                job.session.material(),
                                result->material,
                                fmt::format("opaline-reconstruct {}", version()));
  if (!written) return written;
  return write_whole(job.files,
                     job.session.reconstruction(),
                     reconstruct::summary_json(*dataset, options, *result));
}

}  // namespace
}  // namespace opaline::daemon

int main(int argc, char** argv) {
  return opaline::daemon::run_job(
      argc,
      argv,
      {"reconstruct",
       "Finds the volume of scattering coefficients that explains a session's pictures."},
      opaline::daemon::reconstruct_session);
}
