#include <squeal/mesh/quadratic_cells.h>

#include <algorithm>

namespace squeal
{
  using namespace dealii;

  QuadraticCells QuadraticCells::renumbered(const std::vector<unsigned int> &number) const
  {
    const auto change = [&](auto vertices)
    {
      for (unsigned int &vertex : vertices)
        vertex = number[vertex];
      std::sort(vertices.begin(), vertices.end());
      return vertices;
    };
    QuadraticCells result;
    for (const auto &[vertices, x] : edges)
      result.edges.emplace(change(vertices), x);
    for (const auto &[vertices, x] : faces)
      result.faces.emplace(change(vertices), x);
    result.cells = cells;
    return result;
  }

  std::array<Point<3>, 27> QuadraticCells::points(const unsigned int cell,
                                                  const std::array<Point<3>, 8> &corners,
                                                  const std::array<unsigned int, 8> &vertices) const
  {
    std::array<Point<3>, 27> result;
    for (unsigned int n = 0; n < 27; ++n)
    {
      // Each coordinate of the point is 0, 1/2 or 1; a half lies between vertices of both ends.
      const std::array<unsigned int, 3> at = {{n % 3, n / 3 % 3, n / 9}};
      std::vector<unsigned int> between;
      for (unsigned int v = 0; v < 8; ++v)
      {
        bool takes_part = true;
        for (unsigned int d = 0; d < 3; ++d)
          takes_part = takes_part && (at[d] == 1 || at[d] / 2 == ((v >> d) & 1));
        if (takes_part)
          between.push_back(v);
      }
      const auto sorted = [&](auto numbers)
      {
        for (unsigned int k = 0; k < numbers.size(); ++k)
          numbers[k] = vertices[between[k]];
        std::sort(numbers.begin(), numbers.end());
        return numbers;
      };
      switch (between.size())
      {
      case 1:
        result[n] = corners[between[0]];
        break;
      case 2:
        result[n] = edges.at(sorted(std::array<unsigned int, 2>()));
        break;
      case 4:
        result[n] = faces.at(sorted(std::array<unsigned int, 4>()));
        break;
      default:
        result[n] = cells.at(cell);
      }
    }
    return result;
  }
} // namespace squeal
