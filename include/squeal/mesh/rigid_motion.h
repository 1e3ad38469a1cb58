#pragma once

#include <deal.II/base/point.h>
#include <deal.II/base/tensor.h>

namespace squeal
{
  /// A small rigid motion, t + o x x. In two dimensions o is (0, 0, o).
  template <int dim>
  struct RigidMotion
  {
    dealii::Tensor<1, dim> translation;
    dealii::Tensor<1, 3> rotation;

    dealii::Tensor<1, dim> at(const dealii::Point<dim> &x) const
    {
      dealii::Tensor<1, 3> place;
      for (unsigned int d = 0; d < dim; ++d)
        place[d] = x[d];
      const dealii::Tensor<1, 3> turned = cross_product_3d(rotation, place);
      dealii::Tensor<1, dim> u          = translation;
      for (unsigned int d = 0; d < dim; ++d)
        u[d] += turned[d];
      return u;
    }
    void add(const double factor, const RigidMotion &other)
    {
      translation += factor * other.translation;
      rotation += factor * other.rotation;
    }
  };
} // namespace squeal
