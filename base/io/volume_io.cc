#include "base/io/volume_io.h"

#include <fmt/format.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <sstream>
#include <utility>

namespace opaline {
namespace {

constexpr std::size_t kLargestFile = std::size_t{4} << 30;
constexpr const char* kAbsorption = "absorption";
constexpr const char* kReducedScattering = "reduced_scattering";
constexpr const char* kDiffusion = "diffusion";

struct UncertaintyGrid {
  const char* name;
  LogCoefficients ChannelUncertainty::*kind;
  std::vector<double> LogCoefficients::*field;

  template <class Channel>
  auto& of(Channel& channel) const {
    return channel.*kind.*field;
  }
};
constexpr std::array<UncertaintyGrid, 6> kUncertaintyGrids{
    {{"absorption_log_sd", &ChannelUncertainty::deviation, &LogCoefficients::absorption},
     {"reduced_scattering_log_sd",
      &ChannelUncertainty::deviation,
      &LogCoefficients::reduced_scattering},
     {"diffusion_log_sd", &ChannelUncertainty::deviation, &LogCoefficients::diffusion},
     {"absorption_log_shift", &ChannelUncertainty::shift, &LogCoefficients::absorption},
     {"reduced_scattering_log_shift",
      &ChannelUncertainty::shift,
      &LogCoefficients::reduced_scattering},
     {"diffusion_log_shift", &ChannelUncertainty::shift, &LogCoefficients::diffusion}}};

using Grid = openvdb::Vec3SGrid;

void initialize_once() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

Result<void> check_shapes(const Material& material) {
  const std::size_t cells = material.block.cell_count();
  for (int c = 0; c < kColorChannels; ++c) {
    const ChannelCoefficients& channel = material.channels[c];
    if (channel.absorption.size() != cells || channel.reduced_scattering.size() != cells) {
      return invalid_argument(fmt::format("material: channel {} has {} and {} values for {} cells",
                                          kChannelNames[c],
                                          channel.absorption.size(),
                                          channel.reduced_scattering.size(),
                                          cells));
    }
  }
  return ok();
}

Result<void> check_shapes(const Block& block, const MaterialUncertainty& uncertainty) {
  for (int c = 0; c < kColorChannels; ++c) {
    for (const UncertaintyGrid& grid : kUncertaintyGrids) {
      const std::size_t size = grid.of(uncertainty[c]).size();
      if (size == block.cell_count()) continue;
      return invalid_argument(fmt::format("uncertainty: channel {}, {} has {} values for {} cells",
                                          kChannelNames[c],
                                          grid.name,
                                          size,
                                          block.cell_count()));
    }
  }
  return ok();
}

openvdb::math::Transform::Ptr cell_centres(const Block& block) {
  openvdb::Mat4d map = openvdb::Mat4d::identity();
  map.preScale(openvdb::Vec3d(block.hx, block.hy, block.hz));
  map.postTranslate(openvdb::Vec3d(0.5, 0.5, 0.5) * openvdb::Vec3d(block.hx, block.hy, block.hz));
  return openvdb::math::Transform::createLinearTransform(map);
}

template <class ValueOf>
Grid::Ptr make_grid(const Block& block, const char* name, const char* unit, ValueOf value_of) {
  Grid::Ptr grid = Grid::create(openvdb::Vec3s(0.0f));
  grid->setName(name);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->setVectorType(openvdb::VEC_INVARIANT);
  grid->setTransform(cell_centres(block));
  grid->insertMeta("opaline_unit", openvdb::StringMetadata(unit));
  grid->insertMeta("opaline_channels", openvdb::StringMetadata("red green blue"));
  Grid::Accessor accessor = grid->getAccessor();
  for (int k = 0; k < block.nz; ++k) {
    for (int j = 0; j < block.ny; ++j) {
      for (int i = 0; i < block.nx; ++i) {
        const std::size_t cell = block.index(i, j, k);
        accessor.setValue(openvdb::Coord(i, j, k),
                          openvdb::Vec3s(static_cast<float>(value_of(0, cell)),
                                         static_cast<float>(value_of(1, cell)),
                                         static_cast<float>(value_of(2, cell))));
      }
    }
  }
  return grid;
}

openvdb::GridPtrVec make_grids(const Material& material, const MaterialUncertainty* uncertainty) {
  const auto& channels = material.channels;
  const auto absorption = [&](int c, std::size_t i) { return channels[c].absorption[i]; };
  const auto scattering = [&](int c, std::size_t i) { return channels[c].reduced_scattering[i]; };
  const auto diffusion = [&](int c, std::size_t i) {
    return 1.0 / (3.0 * (absorption(c, i) + scattering(c, i)));
  };
  openvdb::GridPtrVec grids{make_grid(material.block, kAbsorption, "1/mm", absorption),
                            make_grid(material.block, kReducedScattering, "1/mm", scattering),
                            make_grid(material.block, kDiffusion, "mm", diffusion)};
  if (uncertainty == nullptr) return grids;
  for (const UncertaintyGrid& grid : kUncertaintyGrids) {
    grids.push_back(make_grid(material.block, grid.name, "1", [&](int c, std::size_t i) {
      return grid.of((*uncertainty)[c])[i];
    }));
  }
  return grids;
}

openvdb::MetaMap make_metadata(const Material& material, std::string_view generator) {
  const Block& block = material.block;
  openvdb::MetaMap metadata;
  metadata.insertMeta("creator", openvdb::StringMetadata(std::string(generator)));
  metadata.insertMeta("opaline_format", openvdb::Int32Metadata(kMaterialFormat));
  metadata.insertMeta("opaline_generator", openvdb::StringMetadata(std::string(generator)));
  metadata.insertMeta("opaline_name", openvdb::StringMetadata(material.name));
  metadata.insertMeta("opaline_length_unit", openvdb::StringMetadata("mm"));
  metadata.insertMeta("opaline_ior", openvdb::DoubleMetadata(material.ior));
  metadata.insertMeta("opaline_cells",
                      openvdb::Vec3IMetadata(openvdb::Vec3i(block.nx, block.ny, block.nz)));
  metadata.insertMeta("opaline_cell_size",
                      openvdb::Vec3DMetadata(openvdb::Vec3d(block.hx, block.hy, block.hz)));
  return metadata;
}

struct Contents {
  openvdb::GridPtrVec grids;
  openvdb::MetaMap metadata;
};

Contents read_stream(std::string_view bytes) {
  std::istringstream stream{std::string(bytes), std::ios::binary};
  stream.exceptions(std::ios::badbit | std::ios::failbit | std::ios::eofbit);
  openvdb::io::Stream archive(stream, /*delayLoad=*/false);
  return {*archive.getGrids(), *archive.getMetadata()};
}

template <class Meta, class Value>
Result<Value> metadata_value(const openvdb::MetaMap& metadata, const char* name) {
  const auto value = metadata.getMetadata<Meta>(name);
  if (value == nullptr) {
    return invalid_argument(
        fmt::format("not a material written by Opaline: no metadata \"{}\"", name));
  }
  return Value(value->value());
}

Result<Block> read_block(const openvdb::MetaMap& metadata) {
  const auto cells =
      metadata_value<openvdb::Vec3IMetadata, openvdb::Vec3i>(metadata, "opaline_cells");
  if (!cells) return cells.error();
  const auto size =
      metadata_value<openvdb::Vec3DMetadata, openvdb::Vec3d>(metadata, "opaline_cell_size");
  if (!size) return size.error();
  for (int axis = 0; axis < 3; ++axis) {
    const double h = (*size)[axis];
    if ((*cells)[axis] < 1 || (*cells)[axis] > 4096 || !(h > 0.0) || !std::isfinite(h)) {
      return invalid_argument("damaged: the block's cells or their size make no sense");
    }
  }
  return Block{(*cells)[0], (*cells)[1], (*cells)[2], (*size)[0], (*size)[1], (*size)[2]};
}

Result<Grid::Ptr> find_grid(const openvdb::GridPtrVec& grids,
                            const char* name,
                            const Block& block) {
  const auto found = std::find_if(
      grids.begin(), grids.end(), [&](const auto& grid) { return grid->getName() == name; });
  if (found == grids.end()) return invalid_argument(fmt::format("no grid \"{}\"", name));
  Grid::Ptr grid = openvdb::gridPtrCast<Grid>(*found);
  if (!grid) return invalid_argument(fmt::format("grid \"{}\" is not of type vec3s", name));
  if (grid->activeVoxelCount() != block.cell_count()) {
    return invalid_argument(fmt::format("damaged: grid \"{}\" has {} values for {} cells",
                                        name,
                                        grid->activeVoxelCount(),
                                        block.cell_count()));
  }
  return grid;
}

/// One quantity of all channels, none below `least`; `field_of` picks the vector it goes to.
template <class Channel, class FieldOf>
Result<void> read_field(const Contents& contents,
                        const char* name,
                        const Block& block,
                        float least,
                        FieldOf field_of,
                        std::array<Channel, kColorChannels>& channels) {
  const auto grid = find_grid(contents.grids, name, block);
  if (!grid) return grid.error();
  for (auto& channel : channels) field_of(channel).resize(block.cell_count());
  const Grid::ConstAccessor accessor = (*grid)->getConstAccessor();
  for (int k = 0; k < block.nz; ++k) {
    for (int j = 0; j < block.ny; ++j) {
      for (int i = 0; i < block.nx; ++i) {
        const openvdb::Vec3s value = accessor.getValue(openvdb::Coord(i, j, k));
        for (int c = 0; c < kColorChannels; ++c) {
          if (!std::isfinite(value[c]) || value[c] < least) {
            return invalid_argument(
                fmt::format("damaged: {}.{} of cell ({}, {}, {}) is {}; expected a number >= {}",
                            name,
                            kChannelNames[c],
                            i,
                            j,
                            k,
                            value[c],
                            least));
          }
          field_of(channels[c])[block.index(i, j, k)] = value[c];
        }
      }
    }
  }
  return ok();
}

Result<Material> to_material(const Contents& contents) {
  const auto format =
      metadata_value<openvdb::Int32Metadata, int>(contents.metadata, "opaline_format");
  if (!format) return format.error();
  if (*format > kMaterialFormat) {
    return invalid_argument(
        fmt::format("written by a newer version (format {}, this one reads up to {})",
                    *format,
                    kMaterialFormat));
  }
  const auto block = read_block(contents.metadata);
  if (!block) return block.error();
  const auto ior =
      metadata_value<openvdb::DoubleMetadata, double>(contents.metadata, "opaline_ior");
  if (!ior) return ior.error();
  const auto name =
      metadata_value<openvdb::StringMetadata, std::string>(contents.metadata, "opaline_name");
  if (!name) return name.error();
  Material material{*block, *ior, {}, *name};
  const auto read = [&](const char* quantity, std::vector<double> ChannelCoefficients::*field) {
    const auto of = [&](ChannelCoefficients& c) -> std::vector<double>& { return c.*field; };
    return read_field(contents, quantity, *block, 0.0f, of, material.channels);
  };
  if (auto r = read(kAbsorption, &ChannelCoefficients::absorption); !r) return r.error();
  if (auto r = read(kReducedScattering, &ChannelCoefficients::reduced_scattering); !r)
    return r.error();
  return material;
}

/// All of its grids or none.
Result<std::optional<MaterialUncertainty>> to_uncertainty(const Contents& contents) {
  const auto is_there = [&](const UncertaintyGrid& wanted) {
    return std::any_of(contents.grids.begin(), contents.grids.end(), [&](const auto& grid) {
      return grid->getName() == wanted.name;
    });
  };
  if (std::none_of(kUncertaintyGrids.begin(), kUncertaintyGrids.end(), is_there))
    return std::optional<MaterialUncertainty>();
  const auto block = read_block(contents.metadata);
  if (!block) return block.error();
  MaterialUncertainty channels;
  for (const UncertaintyGrid& grid : kUncertaintyGrids) {
    const auto of = [&](ChannelUncertainty& c) -> std::vector<double>& { return grid.of(c); };
    const float least =
        grid.kind == &ChannelUncertainty::shift ? std::numeric_limits<float>::lowest() : 0.0f;
    auto r = read_field(contents, grid.name, *block, least, of, channels);
    if (!r) return r.error();
  }
  return std::optional(std::move(channels));
}

bool starts_like_vdb(std::string_view bytes) {
  constexpr std::string_view magic(" BDV\0\0\0\0", 8);  // OPENVDB_MAGIC, 64-bit little endian
  return bytes.substr(0, magic.size()) == magic;
}

}  // namespace

Result<std::string> encode_material(const Material& material,
                                    std::string_view generator,
                                    const MaterialUncertainty* uncertainty) {
  if (auto shapes = check_shapes(material); !shapes) return shapes.error();
  if (uncertainty != nullptr) {
    if (auto shapes = check_shapes(material.block, *uncertainty); !shapes) return shapes.error();
  }
  try {
    initialize_once();
    std::ostringstream stream(std::ios::binary);
    openvdb::io::Stream archive(stream);
    archive.write(make_grids(material, uncertainty), make_metadata(material, generator));
    return std::move(stream).str();
  } catch (const std::exception& error) {
    return internal_error(fmt::format("OpenVDB: {}", error.what()));
  }
}

Result<Material> decode_material(std::string_view bytes) {
  if (!starts_like_vdb(bytes)) return invalid_argument("not an OpenVDB file");
  try {
    initialize_once();
    return to_material(read_stream(bytes));
  } catch (const std::exception& error) {
    return invalid_argument(fmt::format("truncated or damaged ({})", error.what()));
  }
}

Result<void> write_material(FileOperations& files,
                            const std::filesystem::path& path,
                            const Material& material,
                            std::string_view generator,
                            const MaterialUncertainty* uncertainty) {
  const auto bytes = encode_material(material, generator, uncertainty);
  if (!bytes) return bytes.error().in(path.string());
  return write_whole(files, path, *bytes);
}

Result<Material> read_material(const std::filesystem::path& path) {
  const auto bytes = read_text(path, kLargestFile);
  if (!bytes) return bytes.error();
  auto material = decode_material(*bytes);
  if (!material) return material.error().in(path.string());
  return material;
}

Result<std::optional<MaterialUncertainty>> read_uncertainty(const std::filesystem::path& path) {
  const auto bytes = read_text(path, kLargestFile);
  if (!bytes) return bytes.error();
  if (!starts_like_vdb(*bytes)) return invalid_argument("not an OpenVDB file").in(path.string());
  try {
    initialize_once();
    auto uncertainty = to_uncertainty(read_stream(*bytes));
    if (!uncertainty) return uncertainty.error().in(path.string());
    return uncertainty;
  } catch (const std::exception& error) {
    return invalid_argument(
        fmt::format("{}: truncated or damaged ({})", path.string(), error.what()));
  }
}

}  // namespace opaline
