#include "capture/disk_space.h"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

namespace opaline::capture {
namespace {

Result<std::uint64_t> free_on_disk(const std::filesystem::path& directory) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(directory, error);
  if (error) {
    return unavailable(
        fmt::format("cannot tell the free space of {}: {}", directory.string(), error.message()));
  }
  return static_cast<std::uint64_t>(space.available);
}

}  // namespace

Result<void> require_space(const Workplace& work, std::uint64_t needed, std::size_t missing) {
  const auto free =
      work.free_bytes ? work.free_bytes(work.directory) : free_on_disk(work.directory);
  if (!free) return free.error();
  if (*free >= needed) return ok();
  return unavailable(
      fmt::format("{} needs {} bytes for the {} lights still to take, and {} are free: make room "
                  "and start again, nothing already captured is lost",
                  work.directory.string(),
                  needed,
                  missing,
                  *free));
}

}  // namespace opaline::capture
