#include <squeal/bars/cell_residuals.h>

#include <deal.II/base/quadrature_lib.h>

#include <petscblaslapack.h>

#include <algorithm>
#include <cmath>

// Operators on many functions at once. reinit() sets the points of a cell, or of an element with
// own polynomials; apply() evaluates all functions there, puts in their place what is tested with
// values and derivatives, point by point, and tests it; stiffness() is that of few functions of one
// body.

namespace squeal
{
  using namespace dealii;
  using Complex = std::complex<double>;

  namespace
  {
    /// Values and derivatives of an element's functions at points of the reference cell: row
    /// (field n_q + q), field 0 the value, 1 + d the derivative d.
    template <int dim>
    DenseMatrix at_points(const FiniteElement<dim> &fe, const Quadrature<dim> &quadrature)
    {
      const unsigned int n_q = quadrature.size();
      DenseMatrix result((1 + dim) * n_q, fe.n_dofs_per_cell());
      for (unsigned int a = 0; a < fe.n_dofs_per_cell(); ++a)
        for (unsigned int q = 0; q < n_q; ++q)
        {
          result(q, a)                     = fe.shape_value(a, quadrature.point(q));
          const Tensor<1, dim> derivatives = fe.shape_grad(a, quadrature.point(q));
          for (unsigned int d = 0; d < dim; ++d)
            result((1 + d) * n_q + q, a) = derivatives[d];
        }
      return result;
    }
  } // namespace

  template <int dim>
  CellResiduals<dim>::CellResiduals(const FiniteElementSpace<dim> &trial,
                                    const FiniteElementSpace<dim> &test)
      : test(test), of_cells{unsigned(QGauss<dim>(test.fe.degree + 1).size()),
                             at_points(trial.fe, QGauss<dim>(test.fe.degree + 1)),
                             at_points(test.fe, QGauss<dim>(test.fe.degree + 1)).transpose()},
        now(&of_cells), n_q(of_cells.n_q),
        geometry(test.mapping, test.fe, QGauss<dim>(test.fe.degree + 1),
                 update_inverse_jacobians | update_quadrature_points | update_JxW_values),
        points(n_q), jxw(n_q)
  {
    if constexpr (dim == 3)
      if (!test.geometry.own.empty())
      {
        elements           = std::make_unique<ElementQuadrature>(test);
        trials_of_elements = std::make_unique<ElementInterpolation>(interpolation_of(trial, 0));
      }
  }

  template <int dim>
  void CellResiduals<dim>::reinit(const CellIterator &cell)
  {
    geometry.reinit(cell);
    now = &of_cells;
    n_q = now->n_q;
    points.resize(n_q);
    jxw.resize(n_q);
    for (unsigned int q = 0; q < n_q; ++q)
    {
      const auto &inverse = geometry.inverse_jacobian(q);
      for (unsigned int e = 0; e < dim; ++e)
        for (unsigned int d = 0; d < dim; ++d)
          points[q].inverse[e * dim + d] = inverse[e][d];
      set_point(q, geometry.quadrature_point(q), geometry.JxW(q));
    }
  }

  template <int dim>
  void CellResiduals<dim>::reinit(const typename CellMap<dim>::Element &element)
  {
    if constexpr (dim == 3)
    {
      const auto [found, is_new] = of_elements.try_emplace(element.shape);
      if (is_new)
      {
        const ElementQuadrature::Reference &reference = elements->reference(element.shape);
        found->second                                 = {unsigned(reference.points.size()),
                                                         trials_of_elements->nodal_functions(element.shape, reference.points),
                                                         reference.functions.transpose()};
      }
      now = &found->second;
      n_q = now->n_q;
      points.resize(n_q);
      jxw.resize(n_q);
      elements->reinit(element.shape, element.nodes);
      for (unsigned int q = 0; q < n_q; ++q)
      {
        for (unsigned int e = 0; e < dim; ++e)
          for (unsigned int d = 0; d < dim; ++d)
            points[q].inverse[e * dim + d] = elements->inverse[q][e][d];
        set_point(q, elements->points[q], elements->jxw[q]);
      }
    }
    else
      (void)element;
  }

  /// All of a point but the inverse Jacobian.
  template <int dim>
  void CellResiduals<dim>::set_point(const unsigned int q, const dealii::Point<dim> &x,
                                     const double weight)
  {
    const Tensor<1, dim> w = test.geometry.transport(x);
    for (unsigned int d = 0; d < dim; ++d)
      points[q].transport[d] = w[d];
    points[q].stress = 0;
    jxw[q]           = weight;
  }

  template <int dim>
  void CellResiduals<dim>::gradient_at(const Point &point,
                                       const std::array<const double *, dim> &fields,
                                       double (&gradient)[dim][dim]) const
  {
    for (unsigned int i = 0; i < dim; ++i)
      for (unsigned int d = 0; d < dim; ++d)
      {
        double sum = 0;
        for (unsigned int e = 0; e < dim; ++e)
          sum += point.inverse[e * dim + d] * fields[i][(1 + e) * n_q];
        gradient[i][d] = sum;
      }
  }

  template <int dim>
  void CellResiduals<dim>::stress_of(const ElasticModuli<dim> &C,
                                     const double (&gradient)[dim][dim], double (&stress)[dim][dim])
  {
    for (unsigned int i = 0; i < dim; ++i)
    {
      for (unsigned int d = 0; d < dim; ++d)
        stress[i][d] = C.m[i][d] * (gradient[i][d] + gradient[d][i]);
      for (unsigned int k = 0; k < dim; ++k)
        stress[i][i] += C.l[i][k] * gradient[k][k];
    }
  }

  template <int dim>
  void CellResiduals<dim>::set_stress(const Material &material, const DenseMatrix &u)
  {
    const ElasticModuli<dim> C(material);
    const DenseMatrix at_points = now->evaluation * u;
    for (unsigned int q = 0; q < n_q; ++q)
    {
      std::array<const double *, dim> fields;
      for (unsigned int i = 0; i < dim; ++i)
        fields[i] = &at_points.values[i * at_points.n_rows + q];
      double gradient[dim][dim], stress[dim][dim];
      gradient_at(points[q], fields, gradient);
      stress_of(C, gradient, stress);
      for (unsigned int i = 0; i < dim; ++i)
        for (unsigned int d = 0; d < dim; ++d)
          points[q].stress[i][d] = stress[i][d];
    }
  }

  /// Puts in the place of a function's values and derivatives what is tested with values and
  /// derivatives: with s the stress and d_phi = w.grad
  ///     values       rho [m u + g/2 d_phi u],
  ///     derivatives  k s + v s_v + rho [m_star d_phi u - g/2 u] w^T + stress grad(u) sigma_0.
  template <int dim>
  void CellResiduals<dim>::combine_at_points(const Material &material, const OperatorFactors &c,
                                             double *const *re, double *const *im) const
  {
    const ElasticModuli<dim> C(material), C_v(material.viscosity, material.axis);
    const double rho     = material.density;
    const Complex g_half = rho * c.g / 2., m = rho * c.m, m_star = rho * c.m_star;
    for (unsigned int q = 0; q < n_q; ++q)
    {
      const Point &point = points[q];
      // [part][component][direction]
      double gradient[2][dim][dim], along[2][dim], stress[2][dim][dim], viscous[2][dim][dim];
      for (unsigned int part = 0; part < 2; ++part)
      {
        std::array<const double *, dim> fields;
        for (unsigned int i = 0; i < dim; ++i)
          fields[i] = (part == 0 ? re : im)[i] + q;
        gradient_at(point, fields, gradient[part]);
        for (unsigned int i = 0; i < dim; ++i)
        {
          along[part][i] = 0;
          for (unsigned int d = 0; d < dim; ++d)
            along[part][i] += point.transport[d] * gradient[part][i][d];
        }
        stress_of(C, gradient[part], stress[part]);
        if (c.v != 0.)
          stress_of(C_v, gradient[part], viscous[part]);
      }
      for (unsigned int i = 0; i < dim; ++i)
      {
        double *field_re = re[i] + q, *field_im = im[i] + q;
        const double u_re = field_re[0], u_im = field_im[0], a_re = along[0][i], a_im = along[1][i];
        field_re[0]       = jxw[q] * (m.real() * u_re - m.imag() * u_im + g_half.real() * a_re -
                                g_half.imag() * a_im);
        field_im[0]       = jxw[q] * (m.real() * u_im + m.imag() * u_re + g_half.real() * a_im +
                                g_half.imag() * a_re);
        const double t_re = m_star.real() * a_re - m_star.imag() * a_im - g_half.real() * u_re +
                            g_half.imag() * u_im,
                     t_im = m_star.real() * a_im + m_star.imag() * a_re - g_half.real() * u_im -
                            g_half.imag() * u_re;
        double flux_re[dim], flux_im[dim];
        for (unsigned int d = 0; d < dim; ++d)
        {
          const double s_re = stress[0][i][d], s_im = stress[1][i][d];
          flux_re[d] = jxw[q] * (c.k.real() * s_re - c.k.imag() * s_im + t_re * point.transport[d]);
          flux_im[d] = jxw[q] * (c.k.real() * s_im + c.k.imag() * s_re + t_im * point.transport[d]);
        }
        if (c.v != 0.)
          for (unsigned int d = 0; d < dim; ++d)
          {
            const double s_re = viscous[0][i][d], s_im = viscous[1][i][d];
            flux_re[d] += jxw[q] * (c.v.real() * s_re - c.v.imag() * s_im);
            flux_im[d] += jxw[q] * (c.v.real() * s_im + c.v.imag() * s_re);
          }
        if (c.stress != 0.)
          for (unsigned int d = 0; d < dim; ++d)
            for (unsigned int l = 0; l < dim; ++l)
            {
              const double s = jxw[q] * point.stress[l][d], g_re = gradient[0][i][l],
                           g_im = gradient[1][i][l];
              flux_re[d] += s * (c.stress.real() * g_re - c.stress.imag() * g_im);
              flux_im[d] += s * (c.stress.real() * g_im + c.stress.imag() * g_re);
            }
        for (unsigned int e = 0; e < dim; ++e)
        {
          double sum_re = 0, sum_im = 0;
          for (unsigned int d = 0; d < dim; ++d)
          {
            sum_re += point.inverse[e * dim + d] * flux_re[d];
            sum_im += point.inverse[e * dim + d] * flux_im[d];
          }
          field_re[(1 + e) * n_q] = sum_re;
          field_im[(1 + e) * n_q] = sum_im;
        }
      }
    }
  }

  template <int dim>
  void CellResiduals<dim>::apply(const Material &material,
                                 const std::vector<OperatorFactors> &factors, const DenseMatrix &u,
                                 DenseMatrix &r)
  {
    const unsigned int m = factors.size(), n_fields = now->evaluation.n_rows;
    if (fields.n_rows != n_fields || fields.n_columns != u.n_columns)
      fields = DenseMatrix(n_fields, u.n_columns);
    gemm<double>(1, now->evaluation, u, 0, fields.values.data());
    for (const bool left : {false, true})
      for (unsigned int j = 0; j < m; ++j)
      {
        // Q^H: conjugate factors, and G is skew.
        OperatorFactors c = factors[j];
        if (left)
          c = {std::conj(c.m),      std::conj(c.k),      -std::conj(c.g),
               std::conj(c.m_star), std::conj(c.stress), std::conj(c.v)};
        std::array<double *, dim> re, im;
        for (unsigned int i = 0; i < dim; ++i)
        {
          const std::size_t column = (left ? 2 * m : 0) + j;
          re[i]                    = &fields.values[(column * dim + i) * n_fields];
          im[i]                    = &fields.values[((column + m) * dim + i) * n_fields];
        }
        combine_at_points(material, c, re.data(), im.data());
      }
    gemm<double>(1, now->testing, fields, 0, r.values.data());
  }

  template <int dim>
  DenseMatrix CellResiduals<dim>::reference_derivatives(const DenseMatrix &functions) const
  {
    return of_cells.testing.transpose() * functions;
  }

  template <int dim>
  DenseMatrix CellResiduals<dim>::reference_derivatives(const ElementShape shape,
                                                        const DenseMatrix &functions) const
  {
    return of_elements.at(shape).testing.transpose() * functions;
  }

  template <int dim>
  void CellResiduals<dim>::stiffness(const Material &material, const DenseMatrix &derivatives,
                                     DenseMatrix &result)
  {
    const unsigned int n = derivatives.n_columns, n_rows = dim * n;
    if (products.n_rows != n_rows || scaled.n_columns != n_q)
    {
      scaled   = DenseMatrix(n_rows, n_q);
      products = DenseMatrix(n_rows, n_rows);
    }
    for (unsigned int q = 0; q < n_q; ++q)
    {
      const double root = std::sqrt(jxw[q]);
      for (unsigned int d = 0; d < dim; ++d)
      {
        double *column = &scaled.values[std::size_t(q) * n_rows + d * n];
        for (unsigned int a = 0; a < n; ++a)
        {
          double sum = 0;
          for (unsigned int e = 0; e < dim; ++e)
            sum += points[q].inverse[e * dim + d] * derivatives((1 + e) * n_q + q, a);
          column[a] = root * sum;
        }
      }
    }
    const PetscBLASInt m = n_rows, k = n_q;
    const double one = 1, zero = 0;
    BLASsyrk_("U", "N", &m, &k, &one, scaled.values.data(), &m, &zero, products.values.data(), &m);
    for (unsigned int j = 0; j < n_rows; ++j)
      for (unsigned int i = 0; i < j; ++i)
        products(j, i) = products(i, j);

    // l_ik d_i W_a d_k W_b + m_ik d_k W_a d_i W_b + delta_ik sum_j m_ij d_j W_a d_j W_b
    const ElasticModuli<dim> C(material);
    for (unsigned int i = 0; i < dim; ++i)
      for (unsigned int k = 0; k < dim; ++k)
        for (unsigned int b = 0; b < n; ++b)
          for (unsigned int a = 0; a < n; ++a)
          {
            double value = C.l[i][k] * products(i * n + a, k * n + b) +
                           C.m[i][k] * products(k * n + a, i * n + b);
            for (unsigned int j = 0; j < dim && i == k; ++j)
              value += C.m[i][j] * products(j * n + a, j * n + b);
            result(i * n + a, k * n + b) = value;
          }
  }

  template class CellResiduals<2>;
  template class CellResiduals<3>;
} // namespace squeal
