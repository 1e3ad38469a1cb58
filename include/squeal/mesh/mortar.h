#pragma once

#include <deal.II/base/point.h>
#include <deal.II/base/polynomial.h>
#include <deal.II/base/tensor.h>

#include <vector>

namespace squeal
{
  /// One face of a contact surface as a polynomial patch: the image of the unit square (dim = 3) or
  /// unit interval (dim = 2) under Lagrange interpolation in the Gauss-Lobatto points,
  /// lexicographic.
  template <int dim>
  struct SurfaceFace
  {
    std::vector<dealii::Point<dim>> nodes;
    double orientation =
        1; ///< +-1, the sign that makes the normal of the parametrisation point outwards
  };

  /// Shape functions of all faces of one degree.
  template <int dim>
  class FaceElement
  {
  public:
    static constexpr unsigned int max_degree = 8;

    explicit FaceElement(unsigned int degree);

    unsigned int n_nodes() const
    {
      return n;
    }
    unsigned int degree() const
    {
      return p;
    }

    using Coordinates = dealii::Point<dim - 1>;
    using Gradient    = dealii::Tensor<1, dim - 1>;

    /// Values and, if asked for, gradients with respect to the reference coordinates, at any point.
    void evaluate(const Coordinates &xi, std::vector<double> &values,
                  std::vector<Gradient> *gradients = nullptr) const;

    /// Position, tangents dx/dxi_i and outward normal (scaled by the surface element) on a face.
    struct Frame
    {
      dealii::Point<dim> x;
      std::array<dealii::Tensor<1, dim>, dim - 1> tangents;
      dealii::Tensor<1, dim> normal; ///< unit, outwards
      double measure = 0;
    };
    Frame frame(const SurfaceFace<dim> &face, const Coordinates &xi) const;

    /// The reference coordinates of the point of the face's surface nearest to @p x, extended along
    /// its tangents beyond half a face outside of it. Newton's method; where it does not converge,
    /// far outside the face, the face's linearisation at its centre.
    Coordinates project(const SurfaceFace<dim> &face, const dealii::Point<dim> &x) const;

  private:
    unsigned int p, n;
    std::vector<dealii::Polynomials::Polynomial<double>> basis;
  };

  /// A quadrature point shared by two faces.
  template <int dim>
  struct PairedPoint
  {
    dealii::Point<dim - 1> xi_pad, xi_rotor;
    double weight; ///< surface element of the pad's face times quadrature weight, m^2 (2D: m)
  };

  /// The common part of a pad's face and a rotor's face.
  template <int dim>
  struct FacePair
  {
    unsigned int pad_face, rotor_face;
    std::vector<PairedPoint<dim>> points;
  };

  /// Cuts the pad's faces along the edges of the rotor's faces and puts a quadrature rule on each
  /// piece, so that integrals of products of the two sides' piecewise polynomials see no kink.
  ///
  /// The cutting happens in the reference square of each pad face: the edges of the rotor's faces
  /// are projected there as polygons, divided until they follow the curved edge, and clipped
  /// against the square. Neighbouring faces share their polygon's points, so the pieces tile the
  /// pad's face without gap or overlap. Integrals of products of shape functions are exact where
  /// the surface element of the pad's face is constant and the map between the two reference
  /// squares is affine; else (trapezoids, curved faces) to the order of the quadrature. Faces
  /// further apart than @p search_distance are not paired.
  template <int dim>
  std::vector<FacePair<dim>>
  pair_surfaces(const FaceElement<dim> &element, const std::vector<SurfaceFace<dim>> &pad_faces,
                const std::vector<SurfaceFace<dim>> &rotor_faces, double search_distance);

  /// pair_surfaces() for surfaces that need not be plane: only faces that face each other are
  /// paired, and only points that are at most @p distance apart, m.
  template <int dim>
  std::vector<FacePair<dim>>
  pair_facing_surfaces(const FaceElement<dim> &element, const std::vector<SurfaceFace<dim>> &first,
                       const std::vector<SurfaceFace<dim>> &second, double distance);
} // namespace squeal
