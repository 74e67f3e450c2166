#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/material.h"
#include "base/result.h"
#include "base/session_directory.h"
#include "daemon/scattering/relief.h"
#include "daemon/scattering/sphere_maps.h"
#include "daemon/scattering/sphere_session.h"

namespace opaline::daemon {

/// The object for the volumetric renderer, x right, y up, z towards the camera, from the middle of the picture: maps within three l_d below the seen surface;
/// deeper, behind, and where maps have no answer their medians. Pixels without an answer beside others take their nearest.
/// Errors: kInvalidArgument where no pixel of some channel has an answer.
Result<Material> shell_of(const SphereMaps& maps,
                          const SphereSession& session,
                          const Relief& relief,
                          double ior,
                          std::string name);
/// Corner of the material's block in that frame, mm.
Vec3 shell_origin(const Relief& relief, const Material& shell);

/// material.vdb, shell.obj and scene.toml, which "opaline render" draws as the camera saw it under even light.
/// Errors: as above; the file system's.
Result<void> write_shell(FileOperations& files,
                         const SessionDirectory& directory,
                         const SphereMaps& maps,
                         const SphereSession& session,
                         double ior,
                         const std::string& name);

}  // namespace opaline::daemon
