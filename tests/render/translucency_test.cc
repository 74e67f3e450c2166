#include "render/translucency.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>

#include "base/face_view.h"
#include "reconstruct/diffusion/camera_equation.h"
#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/prediction.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::Boundary;
using reconstruct::diffusion::make_reference_solver;
using reconstruct::diffusion::SourceModel;
using testing::HasSubstr;

Material material_of(const Block& block, std::array<double, 3> absorption) {
  Material material{block, 1.3, {}, "test"};
  for (int c = 0; c < 3; ++c)
    material.channels[c] = {std::vector<double>(block.cell_count(), absorption[c]),
                            std::vector<double>(block.cell_count(), 1.0)};
  return material;
}

Light uniform(const Block& block, Face face, float irradiance) {
  return {face, Image<float>(block.face_width(face), block.face_height(face), 3, irradiance)};
}

const FaceField& on(const SurfaceField& field, Face face) {
  return field.faces[static_cast<std::size_t>(face)];
}

double leaving(const SurfaceField& field, int channel) {
  double power = 0.0;
  for (const Face face : kFaces) {
    const auto flux = on(field, face).net_flux.samples();
    for (std::size_t i = channel; i < flux.size(); i += 3)
      power += field.block.face_cell_area(face) * flux[i];
  }
  return power;
}

TranslucencyOptions options_of(SourceModel model) {
  TranslucencyOptions options;
  options.source.model = model;
  options.solve.tolerance = 1e-9;
  return options;
}

TEST(Illuminate, LetsOutWhatEnteredWhenNothingIsAbsorbed) {
  const Block block{10, 8, 6, 1.0, 1.0, 1.0};
  const Material material = material_of(block, {0.0, 0.0, 0.0});
  const auto solver = make_reference_solver();
  const std::vector lights{uniform(block, Face::kXMax, 2.0F)};
  const double entered = 2.0 * 8 * 6 * (1.0 - reconstruct::diffusion::normal_reflectance(1.3));
  const auto collimated =
      illuminate(material, lights, options_of(SourceModel::kCollimated), *solver, {});
  ASSERT_TRUE(collimated) << collimated.error().message;
  const double ballistic = entered * std::exp(-10.0);
  EXPECT_NEAR(
      leaving(collimated->front(), 0) + ballistic, entered, 1e-6 * entered);  // float32 sums
  // With the surface source J_n is the net flow: what enters is already taken off, so nothing is left over.
  const auto surface = illuminate(material, lights, options_of(SourceModel::kSurface), *solver, {});
  ASSERT_TRUE(surface) << surface.error().message;
  EXPECT_NEAR(leaving(surface->front(), 0), 0.0, 1e-5 * entered);
}

TEST(Illuminate, KeepsTheChannelsApart) {
  const Block block{6, 6, 4, 1.0, 1.0, 1.0};
  const Material material = material_of(block, {0.001, 0.01, 0.1});
  const auto solver = make_reference_solver();
  const std::vector lights{uniform(block, Face::kZMin, 1.0F)};
  const auto fields = illuminate(material, lights, {}, *solver, {});
  ASSERT_TRUE(fields) << fields.error().message;
  const Image<float>& flux = on(fields->front(), Face::kZMax).net_flux;
  EXPECT_GT(flux.at(3, 3, 0), flux.at(3, 3, 1));  // the more a channel absorbs, the darker
  EXPECT_GT(flux.at(3, 3, 1), flux.at(3, 3, 2));
  EXPECT_GT(flux.at(3, 3, 2), 0.0F);
}

TEST(Illuminate, AnswersEachLightInItsPlaceAndSuperposes) {
  const Block block{7, 5, 4, 0.8, 1.0, 1.2};
  const Material material = material_of(block, {0.01, 0.02, 0.03});
  const auto solver = make_reference_solver();
  Light spot{Face::kZMin, Image<float>(7, 5, 3)};
  for (int c = 0; c < 3; ++c) spot.irradiance.at(5, 1, c) = 3.0F;
  const Light side = uniform(block, Face::kYMax, 1.0F);
  const auto fields = illuminate(
      material, std::vector{spot, side}, options_of(SourceModel::kCollimated), *solver, {});
  ASSERT_TRUE(fields && fields->size() == 2U);
  const Image<float>& far_side = on((*fields)[0], Face::kZMax).net_flux;
  for (int y = 0; y < 5; ++y)
    for (int x = 0; x < 7; ++x)
      EXPECT_LE(far_side.at(x, y, 0), far_side.at(5, 1, 0)) << x << " " << y;
  const auto alone =
      illuminate(material, std::vector{side}, options_of(SourceModel::kCollimated), *solver, {});
  ASSERT_TRUE(alone);
  EXPECT_NEAR(on((*fields)[1], Face::kXMin).fluence.at(2, 2, 1),
              on(alone->front(), Face::kXMin).fluence.at(2, 2, 1),
              1e-6);
}

// The radiance towards the eye, by the P1 law from the field, is what the reconstruction predicts of unlit cells; in float32.
TEST(Illuminate, ShinesTowardsTheEyeAsTheReconstructionPredicts) {
  const Block block{8, 6, 5, 0.8, 1.0, 0.6};
  const Material material = material_of(block, {0.01, 0.02, 0.03});
  const auto solver = make_reference_solver();
  Light spot{Face::kXMax, Image<float>(6, 5, 3)};
  for (int c = 0; c < 3; ++c) spot.irradiance.at(1, 3, c) = 2.0F;
  const FaceView view = view_of_face(block, Face::kXMax, {30.0, -12.0, 20.0});
  Dataset dataset{.block = block,
                  .ior = material.ior,
                  .lit_face = Face::kXMax,
                  .seen_face = Face::kXMax,
                  .view_cosine = view.cosine,
                  .view_direction = view.direction,
                  .illuminations = {{.name = "spot",
                                     .held_out = false,
                                     .irradiance = spot.irradiance,
                                     .radiance = Image<float>(6, 5, 3),
                                     .radiance_variance = Image<float>(6, 5, 3, 1.0F),
                                     .mask = Image<std::uint8_t>(6, 5, 1, 1)}},
                  .uniform = {}};
  TranslucencyOptions options = options_of(SourceModel::kCollimated);
  options.eye = Vec3{30.0, -12.0, 20.0};
  const auto fields = illuminate(material, std::vector{spot}, options, *solver, {});
  ASSERT_TRUE(fields) << fields.error().message;
  const auto predicted = reconstruct::predict(dataset, material, {.tolerance = 1e-9}, *solver, {});
  ASSERT_TRUE(predicted) << predicted.error().message;
  const FaceField& face = on(fields->front(), Face::kXMax);
  const Boundary boundary = *reconstruct::diffusion::make_boundary(
      reconstruct::diffusion::BoundaryModel::kTwoMoment, material.ior);
  for (int y = 0; y < 5; ++y) {
    for (int x = 0; x < 6; ++x) {
      const auto p1 =
          reconstruct::diffusion::camera_equation(material.ior, boundary, view.cosine.at(x, y));
      const double source = face.fluence.at(x, y, 1) - 2.0 * boundary.a * face.net_flux.at(x, y, 1);
      const double shown = p1.radiance(source, face.net_flux.at(x, y, 1));
      const double diffuse = predicted->front().at(x, y, 1);
      if (x == 1 && y == 3) {
        EXPECT_GT(shown, diffuse) << "the lit cell, with what shines there beyond diffusion";
      } else {
        EXPECT_NEAR(shown, diffuse, 2e-6 * predicted->front().at(1, 3, 1));
      }
    }
  }
}

TEST(Illuminate, RefusesALightThatDoesNotFitTheFace) {
  const Block block{6, 5, 4, 1.0, 1.0, 1.0};
  const auto solver = make_reference_solver();
  const std::vector lights{Light{Face::kXMin, Image<float>(6, 5, 3)}};
  const auto refused = illuminate(material_of(block, {0, 0, 0}), lights, {}, *solver, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("face x_min"));
}

TEST(Illuminate, StopsWhenAsked) {
  const Block block{6, 5, 4, 1.0, 1.0, 1.0};
  const auto solver = make_reference_solver();
  std::stop_source source;
  source.request_stop();
  const std::vector lights{uniform(block, Face::kZMin, 1.0F)};
  const auto stopped =
      illuminate(material_of(block, {0, 0, 0}), lights, {}, *solver, source.get_token());
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace opaline::render
