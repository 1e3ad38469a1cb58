#pragma once

#include <squeal/linalg/dense.h>

#include <deal.II/base/point.h>

#include <array>
#include <string>
#include <vector>

namespace squeal
{
  /// Which rigid motions supports and joints leave to some bodies: the null space of the sum of
  /// r r^T over the motions r that they forbid, six numbers of each body.
  class RigidMotions
  {
  public:
    static constexpr unsigned int ground = -1;

    explicit RigidMotions(const unsigned int n_bodies = 1) : held(6 * n_bodies, 6 * n_bodies) {}

    /// Holds component @p c of the displacement of a body at @p x, a position in units of the
    /// bodies' size.
    void hold(const dealii::Point<3> &x, const unsigned int c, const unsigned int body = 0)
    {
      connect(body, x, ground, x, c);
    }
    /// Holds two bodies, or one and the ground, together: the displacement along (c < 3) or the
    /// rotation about an axis at a point of each.
    void connect(unsigned int first, const dealii::Point<3> &at_first, unsigned int second,
                 const dealii::Point<3> &at_second, unsigned int c);
    /// Holds them along or about any unit vector.
    void connect(unsigned int first, const dealii::Point<3> &at_first, unsigned int second,
                 const dealii::Point<3> &at_second, const std::array<double, 3> &direction,
                 bool rotates);
    /// Holds a body where a stiffness for its rigid motions, about the origin of positions, in
    /// units of their size, has energy.
    void hold_by(const DenseMatrix &stiffness, unsigned int body);

    /// The number of independent motions that each body has among those that are left.
    std::vector<unsigned int> n_free() const;
    /// Names of the coordinates in which a body can move most: "along x, about z".
    std::string describe(unsigned int body) const;

    /// An orthonormal basis of the motions left: six numbers of each body, the displacement at the
    /// origin and the rotation.
    std::vector<std::vector<double>> basis() const;

  private:
    /// For a body the sum of v v^T over its part of an orthonormal basis of the motions left.
    DenseMatrix projector(unsigned int body) const;
    DenseMatrix held;
  };
} // namespace squeal
