#include <squeal/mesh/element_functions.h>
#include <squeal/mesh/own_elements.h>

#include <deal.II/fe/fe_q.h>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

namespace squeal::tests::own_elements_tests
{
  using namespace dealii;

  namespace
  {
    /// The corner of a tetrahedron's cell that lies at vertex v of the tetrahedron (deal.II's
    /// order).
    std::array<std::uint8_t, 8> cell_at(const unsigned int v)
    {
      const unsigned int a = (v + 1) % 4, b = (v + 2) % 4, c = (v + 3) % 4;
      const auto set = [](const std::vector<unsigned int> &corners)
      {
        std::uint8_t result = 0;
        for (const unsigned int corner : corners)
          result |= 1u << corner;
        return result;
      };
      return {{set({v}), set({v, a}), set({v, b}), set({v, a, b}), set({v, c}), set({v, a, c}),
               set({v, b, c}), 15}};
    }

    /// A polynomial with all terms up to a degree in three coordinates.
    double polynomial(const Point<3> &x, const unsigned int degree)
    {
      return std::pow(0.3 + x[0] - 0.7 * x[1] + 0.45 * x[2], degree) +
             0.2 * std::pow(x[0] + 0.1, degree) - 0.5 * std::pow(x[2] - 0.3, degree);
    }
  } // namespace

  TEST_CASE("own elements: nodes of a tetrahedron's cells follow from its own")
  {
    const unsigned int n_functions[] = {0, 4, 10, 20, 35};
    for (unsigned int degree = 1; degree <= 4; ++degree)
    {
      const FE_Q<3> fe(degree);
      ElementInterpolation interpolation(fe.get_unit_support_points(), degree, degree);
      std::vector<bool> found(n_functions[degree]);
      for (unsigned int v = 0; v < 4; ++v)
      {
        const auto &table = interpolation.of(ElementShape::tetrahedron, cell_at(v));
        REQUIRE(table.own_places.size() == n_functions[degree]);
        for (unsigned int a = 0; a < fe.n_dofs_per_cell(); ++a)
        {
          double sum = 0;
          for (unsigned int k = 0; k < table.own_places.size(); ++k)
            sum += table.weights(a, k) * polynomial(table.own_places[k], degree);
          CHECK(std::abs(sum - polynomial(table.places[a], degree)) < 1e-11);
          if (table.own[a] >= 0)
            found[table.own[a]] = true;
        }
      }
      // Each own node is a node of some cell.
      CHECK(std::count(found.begin(), found.end(), true) == n_functions[degree]);
    }
  }

  TEST_CASE("own elements: a cell's polynomials are the tetrahedron's")
  {
    // Half way between nodes the cell's functions must give what the tetrahedron's polynomial is.
    const FE_Q<3> fe(3);
    ElementInterpolation interpolation(fe.get_unit_support_points(), 3, 3);
    const auto &table = interpolation.of(ElementShape::tetrahedron, cell_at(2));
    const Point<3> xi(0.37, 0.81, 0.12);
    Point<3> place;
    double value = 0;
    for (unsigned int a = 0; a < fe.n_dofs_per_cell(); ++a)
    {
      place += fe.shape_value(a, xi) * table.places[a];
      for (unsigned int k = 0; k < table.own_places.size(); ++k)
        value += fe.shape_value(a, xi) * table.weights(a, k) * polynomial(table.own_places[k], 3);
    }
    CHECK(std::abs(value - polynomial(place, 3)) < 1e-12);
  }

  TEST_CASE("own elements: functions of one degree more")
  {
    struct Wanted
    {
      ElementShape shape;
      unsigned int degree, n_base, n_added;
    };
    for (const Wanted &wanted : {Wanted{ElementShape::tetrahedron, 1, 4, 6},
                                 {ElementShape::tetrahedron, 2, 10, 10},
                                 {ElementShape::tetrahedron, 3, 20, 15},
                                 {ElementShape::wedge, 2, 18, 22},
                                 {ElementShape::hexahedron, 2, 27, 37}})
    {
      const ElementFunctions functions(wanted.shape, wanted.degree);
      CHECK(functions.n_base() == wanted.n_base);
      CHECK(functions.n_added() == wanted.n_added);
      // They vanish at corners, and inside of edges and faces that do not carry them.
      const std::vector<Point<3>> &corners = reference_corners(wanted.shape);
      std::vector<Point<3>> places         = corners;
      for (const Point<3> &a : corners)
        for (const Point<3> &b : corners)
          places.push_back(Point<3>(0.37 * a + 0.63 * b));
      const DenseMatrix values = functions.added_at(places);
      for (unsigned int w = 0; w < functions.n_added(); ++w)
        for (unsigned int a = 0; a < places.size(); ++a)
          if ((functions.carrier_of_added(w) & ~carrier_of(wanted.shape, places[a])) != 0)
            CHECK(values(a, w) == 0);
      // Together they are independent.
      std::vector<Point<3>> many;
      for (unsigned int k = 0; k < 200; ++k)
        many.emplace_back(std::fmod(0.819173 * k, 1), std::fmod(0.671044 * k, 1),
                          std::fmod(0.549700 * k, 1));
      const DenseMatrix base = functions.base_at(many), added = functions.added_at(many);
      std::vector<double> values_of_all = base.values;
      values_of_all.insert(values_of_all.end(), added.values.begin(), added.values.end());
      const DenseMatrix all(many.size(), wanted.n_base + wanted.n_added, std::move(values_of_all));
      CHECK_NOTHROW(PositiveFactors(all.transpose() * all));
    }
  }
} // namespace squeal::tests::own_elements_tests
