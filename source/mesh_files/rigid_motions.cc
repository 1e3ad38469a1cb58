#include <squeal/mesh_files/rigid_motions.h>

#include <deal.II/base/tensor.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    constexpr double relative_rounding = 1e-9;

    /// The displacement along, or the rotation about, an axis at x is this times (t, o) of
    /// u = t + o x x: e.u = e.t + (x x e).o.
    std::array<double, 6> row_of(const Point<3> &x, const std::array<double, 3> &direction,
                                 const bool rotates)
    {
      std::array<double, 6> row{};
      std::copy(direction.begin(), direction.end(), row.begin() + (rotates ? 3 : 0));
      if (rotates)
        return row;
      const Tensor<1, 3> e({direction[0], direction[1], direction[2]}),
          turn = cross_product_3d(Tensor<1, 3>(x), e);
      for (unsigned int d = 0; d < 3; ++d)
        row[3 + d] = turn[d];
      return row;
    }
  } // namespace

  void RigidMotions::connect(const unsigned int first, const Point<3> &at_first,
                             const unsigned int second, const Point<3> &at_second,
                             const unsigned int c)
  {
    std::array<double, 3> direction = {};
    direction[c % 3]                = 1;
    connect(first, at_first, second, at_second, direction, c >= 3);
  }

  void RigidMotions::hold_by(const DenseMatrix &stiffness, const unsigned int body)
  {
    constexpr double smallest             = 1e-7; // of energies: what matrices of ten digits leave
    DenseMatrix vectors                   = stiffness;
    const std::vector<double> eigenvalues = symmetric_eigen(vectors);
    for (unsigned int k = 0; k < eigenvalues.size(); ++k)
      if (eigenvalues[k] > 0 && eigenvalues[k] > smallest * eigenvalues.back())
        for (unsigned int i = 0; i < 6; ++i)
          for (unsigned int j = 0; j < 6; ++j)
            held(6 * body + i, 6 * body + j) += vectors(i, k) * vectors(j, k);
  }

  void RigidMotions::connect(const unsigned int first, const Point<3> &at_first,
                             const unsigned int second, const Point<3> &at_second,
                             const std::array<double, 3> &direction, const bool rotates)
  {
    std::vector<std::pair<unsigned int, double>> forbidden;
    const auto add = [&](const unsigned int body, const Point<3> &x, const double sign)
    {
      if (body == ground)
        return;
      const std::array<double, 6> row = row_of(x, direction, rotates);
      for (unsigned int i = 0; i < 6; ++i)
        forbidden.emplace_back(6 * body + i, sign * row[i]);
    };
    add(first, at_first, 1);
    add(second, at_second, -1);
    for (const auto &[i, a] : forbidden)
      for (const auto &[j, b] : forbidden)
        held(i, j) += a * b;
  }

  std::vector<std::vector<double>> RigidMotions::basis() const
  {
    DenseMatrix vectors                   = held;
    const std::vector<double> eigenvalues = symmetric_eigen(vectors);
    std::vector<std::vector<double>> result;
    for (unsigned int k = 0; k < eigenvalues.size(); ++k)
      if (eigenvalues[k] <= relative_rounding * eigenvalues.back())
        result.emplace_back(&vectors(0, k), &vectors(0, k) + vectors.n_rows);
    return result;
  }

  DenseMatrix RigidMotions::projector(const unsigned int body) const
  {
    DenseMatrix result(6, 6);
    for (const std::vector<double> &motion : basis())
      for (unsigned int i = 0; i < 6; ++i)
        for (unsigned int j = 0; j < 6; ++j)
          result(i, j) += motion[6 * body + i] * motion[6 * body + j];
    return result;
  }

  std::vector<unsigned int> RigidMotions::n_free() const
  {
    std::vector<unsigned int> result;
    for (unsigned int body = 0; body < held.n_rows / 6; ++body)
    {
      DenseMatrix left = projector(body);
      result.push_back(0);
      for (const double value : symmetric_eigen(left))
        result.back() += value > 1e-8;
    }
    return result;
  }

  std::string RigidMotions::describe(const unsigned int body) const
  {
    const std::array<std::string, 6> names = {
        {"along x", "along y", "along z", "about x", "about y", "about z"}};
    const DenseMatrix left = projector(body);
    double most            = 0;
    for (unsigned int i = 0; i < 6; ++i)
      most = std::max(most, left(i, i));
    std::string text;
    for (unsigned int i = 0; i < 6; ++i)
      if (left(i, i) > most / 4)
        text += (text.empty() ? "" : ", ") + names[i];
    return text;
  }
} // namespace squeal
