#include <squeal/run/memory_prediction.h>

#include <doctest/doctest.h>

#include <cmath>
namespace squeal::tests::memory_prediction_tests
{
  TEST_CASE("memory prediction: the plate that stands for a rotor")
  {
    // A disc: the ring of its radii. Its faces and its edges are more than twice that.
    const double ring = M_PI * (0.15 * 0.15 - 0.05 * 0.05), edges = 2 * M_PI * 0.2 * 0.012;
    const Plate disc = plate_like(0.05, 0.15, 2 * ring + edges, ring * 0.012);
    CHECK(std::abs(disc.area - ring) <= 1e-15);
    CHECK(std::abs(disc.thickness - 0.012) <= 1e-15);
    // A plate of 0.2 m times 0.1 m, 5 mm thick, 1 m beside the axis: not the ring of 1.3 m^2 about
    // the axis, which, with the same volume, would be 70 times as thin and have 4000 times as many
    // modes.
    const double surface = 2 * (0.2 * 0.1 + 0.2 * 0.005 + 0.1 * 0.005);
    const Plate plate    = plate_like(0.95, std::hypot(1.15, 0.05), surface, 0.2 * 0.1 * 0.005);
    CHECK(std::abs(plate.area - surface / 2) <= 1e-15);
    CHECK(std::abs(plate.area * plate.thickness - 1e-4) <= 1e-15);
    CHECK(plate.thickness > 0.0045);
  }
} // namespace squeal::tests::memory_prediction_tests
