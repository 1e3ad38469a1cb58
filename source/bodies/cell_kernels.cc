#include <squeal/bodies/cell_kernels.h>

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>

// Compiled for wider registers too; the loader takes what the processor has. (Levels and not names
// of processors: these are of one maker.) Everything below is inlined into the functions with this
// attribute, for it to be compiled so.
#define SQUEAL_WIDE __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#define SQUEAL_INLINE __attribute__((always_inline)) inline

namespace squeal
{
  namespace
  {
    constexpr unsigned int power(const unsigned int base, const unsigned int exponent)
    {
      return exponent == 0 ? 1 : base * power(base, exponent - 1);
    }

    /// The n x n matrix times n chunks of @p width numbers that stand @p step apart; may be in
    /// place.
    template <int n, int width, bool add>
    SQUEAL_INLINE void transform(const double *matrix, const double *in, const unsigned int in_step,
                                 double *out, const unsigned int out_step)
    {
#pragma GCC ivdep
      for (int e = 0; e < width; ++e)
      {
        double x[n];
#pragma GCC unroll 16
        for (int k = 0; k < n; ++k)
          x[k] = in[k * in_step + e];
#pragma GCC unroll 16
        for (int q = 0; q < n; ++q)
        {
          double sum = add ? out[q * out_step + e] : 0.;
#pragma GCC unroll 16
          for (int k = 0; k < n; ++k)
            sum += matrix[q * n + k] * x[k];
          out[q * out_step + e] = sum;
        }
      }
    }

    /// Transforms all lines along coordinate @p direction of a grid of @p n_points; neighbours in
    /// the first direction stand in_step and out_step apart.
    template <int n, int width, bool add>
    SQUEAL_INLINE void transform_lines(const double *matrix, const unsigned int direction,
                                       const unsigned int n_points, const double *in,
                                       const unsigned int in_step, double *out,
                                       const unsigned int out_step)
    {
      unsigned int stride = 1;
      for (unsigned int d = 0; d < direction; ++d)
        stride *= n;
      for (unsigned int outer = 0; outer < n_points; outer += n * stride)
        for (unsigned int first = outer; first < outer + stride; ++first)
          transform<n, width, add>(matrix, in + first * in_step, stride * in_step,
                                   out + first * out_step, stride * out_step);
    }

    /// At one point values become what is tested with v, and reference gradients (by direction and
    /// component) what is tested with reference gradients of v, times the weight:
    ///     K:   s_ij = d_ij sum_k l_ik d_k u_k + m_ij (d_j u_i + d_i u_j), tested with d_j v_i,
    ///     M*:  m_star rho (w . grad u) (w . grad v),
    ///     G:   g rho/2 [(w . grad u) . v - u . (w . grad v)].
    template <int dim, bool is_elastic, bool turns>
    SQUEAL_INLINE void apply_law(const CellLaw<dim> &law, const double *weights,
                                 const double *inverse_jacobian, const double *transport,
                                 const double *values, double *gradients, double *forces)
    {
      constexpr int width = dim * n_lanes;
      const auto l = law.l, m = law.m;
      const double m_star = law.m_star, half_g = law.g / 2, mass = law.mass;
#pragma GCC ivdep
      for (unsigned int e = 0; e < n_lanes; ++e)
      {
        const double weight = weights[e];
        double u[dim], reference[dim][dim], flux[dim][dim];
#pragma GCC unroll 3
        for (int c = 0; c < dim; ++c)
          u[c] = values[c * n_lanes + e];
        if (is_elastic || turns)
#pragma GCC unroll 3
          for (int d = 0; d < dim; ++d)
#pragma GCC unroll 3
            for (int c = 0; c < dim; ++c)
            {
              reference[d][c] = gradients[d * width + c * n_lanes + e];
              flux[d][c]      = 0;
            }
        if (is_elastic)
        {
          double inverse[dim][dim], gradient[dim][dim], s[dim][dim];
#pragma GCC unroll 3
          for (int d = 0; d < dim; ++d)
#pragma GCC unroll 3
            for (int i = 0; i < dim; ++i)
              inverse[d][i] = inverse_jacobian[(d * dim + i) * n_lanes + e];
#pragma GCC unroll 3
          for (int c = 0; c < dim; ++c)
#pragma GCC unroll 3
            for (int i = 0; i < dim; ++i)
            {
              gradient[c][i] = reference[0][c] * inverse[0][i];
#pragma GCC unroll 3
              for (int d = 1; d < dim; ++d)
                gradient[c][i] += reference[d][c] * inverse[d][i];
            }
#pragma GCC unroll 3
          for (int i = 0; i < dim; ++i)
          {
            s[i][i] = 2 * m[i][i] * gradient[i][i];
#pragma GCC unroll 3
            for (int k = 0; k < dim; ++k)
              s[i][i] += l[i][k] * gradient[k][k];
#pragma GCC unroll 3
            for (int j = 0; j < i; ++j)
              s[i][j] = s[j][i] = m[i][j] * (gradient[i][j] + gradient[j][i]);
          }
#pragma GCC unroll 3
          for (int d = 0; d < dim; ++d)
#pragma GCC unroll 3
            for (int c = 0; c < dim; ++c)
#pragma GCC unroll 3
              for (int j = 0; j < dim; ++j)
                flux[d][c] += inverse[d][j] * s[c][j];
        }
        if (turns)
        {
          double w[dim];
#pragma GCC unroll 3
          for (int d = 0; d < dim; ++d)
            w[d] = transport[d * n_lanes + e];
#pragma GCC unroll 3
          for (int c = 0; c < dim; ++c)
          {
            double turned = w[0] * reference[0][c];
#pragma GCC unroll 3
            for (int d = 1; d < dim; ++d)
              turned += w[d] * reference[d][c];
            const double along_w = m_star * turned - half_g * u[c];
#pragma GCC unroll 3
            for (int d = 0; d < dim; ++d)
              flux[d][c] += along_w * w[d];
            forces[c * n_lanes + e] += weight * (mass * u[c] + half_g * turned);
          }
        }
        else
#pragma GCC unroll 3
          for (int c = 0; c < dim; ++c)
            forces[c * n_lanes + e] += weight * mass * u[c];
        if (is_elastic || turns)
#pragma GCC unroll 3
          for (int d = 0; d < dim; ++d)
#pragma GCC unroll 3
            for (int c = 0; c < dim; ++c)
              gradients[d * width + c * n_lanes + e] = weight * flux[d][c];
      }
    }

    /// The one-dimensional matrices and their transposes, and room for the values of a batch.
    template <int dim, int n>
    struct Scratch
    {
      static constexpr unsigned int n_points = power(n, dim), slab = n_points / n,
                                    width = dim * n_lanes;
      alignas(64) double interpolation[n * n], to_nodes[n * n],
          differentiation[n * n], to_points[n * n];
      alignas(64) double values[n_points * width], forces[n_points * width],
          gradients[slab * dim * width];

      explicit Scratch(const CellBatches<dim> &batches)
      {
        for (int q = 0; q < n; ++q)
          for (int k = 0; k < n; ++k)
          {
            interpolation[q * n + k] = to_nodes[k * n + q] = batches.interpolation[q * n + k];
            differentiation[q * n + k] = to_points[k * n + q] = batches.differentiation[q * n + k];
          }
      }
    };

    /// From values at the points to forces at the points. Gradients are never there at once, but
    /// in slabs of one value of the last coordinate: what is in use fits into the smallest cache.
    template <int dim, int n, bool is_elastic, bool turns>
    SQUEAL_INLINE void integrate(Scratch<dim, n> &s, const CellLaw<dim> &law, const double *weights,
                                 const double *inverse_jacobians, const double *transport)
    {
      using S                     = Scratch<dim, n>;
      constexpr unsigned int slab = S::slab, width = S::width, last = dim - 1;
      std::fill_n(s.forces, S::n_points * width, 0.);
      for (unsigned int layer = 0; layer < n; ++layer)
      {
        const unsigned int first = layer * slab;
        if (is_elastic || turns)
        {
          for (unsigned int d = 0; d < last; ++d)
            transform_lines<n, width, false>(s.differentiation, d, slab, s.values + first * width,
                                             width, s.gradients + d * width, dim * width);
          for (unsigned int q = 0; q < slab; ++q)
          {
            const double *in = s.values + q * width;
            double *out      = s.gradients + (q * dim + last) * width;
#pragma GCC ivdep
            for (unsigned int e = 0; e < width; ++e)
            {
              double sum = 0;
#pragma GCC unroll 16
              for (int k = 0; k < n; ++k)
                sum += s.differentiation[layer * n + k] * in[k * slab * width + e];
              out[e] = sum;
            }
          }
        }
        for (unsigned int q = 0; q < slab; ++q)
          apply_law<dim, is_elastic, turns>(
              law, weights + (first + q) * n_lanes,
              inverse_jacobians + (first + q) * dim * dim * n_lanes,
              turns ? transport + (first + q) * dim * n_lanes : nullptr,
              s.values + (first + q) * width, s.gradients + q * dim * width,
              s.forces + (first + q) * width);
        if (is_elastic || turns)
        {
          for (unsigned int d = 0; d < last; ++d)
            transform_lines<n, width, true>(s.to_points, d, slab, s.gradients + d * width,
                                            dim * width, s.forces + first * width, width);
          for (unsigned int q = 0; q < slab; ++q)
          {
            const double *in = s.gradients + (q * dim + last) * width;
            double *out      = s.forces + q * width;
#pragma GCC ivdep
            for (unsigned int e = 0; e < width; ++e)
            {
              const double x = in[e];
#pragma GCC unroll 16
              for (int k = 0; k < n; ++k)
                out[k * slab * width + e] += s.differentiation[layer * n + k] * x;
            }
          }
        }
      }
    }

    template <int dim, int n>
    SQUEAL_WIDE void add_batch(Scratch<dim, n> &s, const CellBatches<dim> &batches,
                               const unsigned int batch, const CellLaw<dim> &law, const double *x,
                               double *y)
    {
      using S                         = Scratch<dim, n>;
      constexpr unsigned int n_points = S::n_points, width = S::width, n_places = n_points * width;
      const unsigned int *indices = batches.indices.data() + std::size_t(batch) * n_places;
      for (unsigned int place = 0; place < n_places; ++place)
        s.values[place] = x[indices[place]];
      for (const unsigned int place : batches.without_entry[batch])
        s.values[place] = 0;
      for (const auto &share : batches.shares[batch])
        s.values[share.place] += share.weight * x[share.index];

      for (unsigned int d = 0; d < dim; ++d)
        transform_lines<n, width, false>(s.interpolation, d, n_points, s.values, width, s.values,
                                         width);
      const std::size_t first = std::size_t(batch) * n_points * n_lanes;
      const double *weights   = batches.weights.data() + first,
                   *inverse   = batches.inverse_jacobians.data() + dim * dim * first,
                   *w         = law.turns() ? batches.transport.data() + dim * first : nullptr;
      if (law.is_elastic && law.turns())
        integrate<dim, n, true, true>(s, law, weights, inverse, w);
      else if (law.is_elastic)
        integrate<dim, n, true, false>(s, law, weights, inverse, w);
      else if (law.turns())
        integrate<dim, n, false, true>(s, law, weights, inverse, w);
      else
        integrate<dim, n, false, false>(s, law, weights, inverse, w);
      for (unsigned int d = 0; d < dim; ++d)
        transform_lines<n, width, false>(s.to_nodes, d, n_points, s.forces, width, s.forces, width);

      for (const auto &share : batches.shares[batch])
        y[share.index] += share.weight * s.forces[share.place];
      for (const unsigned int place : batches.without_entry[batch])
        s.forces[place] = 0;
      for (unsigned int place = 0; place < n_places; ++place)
        y[indices[place]] += s.forces[place];
    }

    /// All columns of a batch while its geometry is in the cache.
    template <int dim, int n>
    void add_all(const CellBatches<dim> &batches, const std::vector<CellLaw<dim>> &laws,
                 const std::vector<const double *> &x, const std::vector<double *> &y)
    {
      const auto scratch = std::make_unique<Scratch<dim, n>>(batches);
      for (unsigned int batch = 0; batch < batches.laws.size(); ++batch)
      {
        const CellLaw<dim> &law = laws[batches.laws[batch]];
        if (law.is_elastic || law.turns() || law.mass != 0)
          for (unsigned int j = 0; j < x.size(); ++j)
            add_batch<dim, n>(*scratch, batches, batch, law, x[j], y[j]);
      }
    }
  } // namespace

  template <int dim>
  unsigned int CellBatches<dim>::n_points() const
  {
    return power(degree + 1, dim);
  }

  template <int dim>
  void add_products(const CellBatches<dim> &batches, const std::vector<CellLaw<dim>> &laws,
                    const std::vector<const double *> &x, const std::vector<double *> &y)
  {
    // All degrees that a parameter file may ask for.
    switch (batches.degree)
    {
    case 1:
      return add_all<dim, 2>(batches, laws, x, y);
    case 2:
      return add_all<dim, 3>(batches, laws, x, y);
    case 3:
      return add_all<dim, 4>(batches, laws, x, y);
    case 4:
      return add_all<dim, 5>(batches, laws, x, y);
    case 5:
      return add_all<dim, 6>(batches, laws, x, y);
    case 6:
      return add_all<dim, 7>(batches, laws, x, y);
    case 7:
      return add_all<dim, 8>(batches, laws, x, y);
    case 8:
      return add_all<dim, 9>(batches, laws, x, y);
    default:
      throw std::logic_error("no products of degree " + std::to_string(batches.degree));
    }
  }

  template struct CellBatches<2>;
  template struct CellBatches<3>;
  template void add_products(const CellBatches<2> &, const std::vector<CellLaw<2>> &,
                             const std::vector<const double *> &, const std::vector<double *> &);
  template void add_products(const CellBatches<3> &, const std::vector<CellLaw<3>> &,
                             const std::vector<const double *> &, const std::vector<double *> &);
} // namespace squeal
