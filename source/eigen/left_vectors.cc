#include <squeal/base/text.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/ritz.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Columns of the solution X of A X = B, complex, by Gaussian elimination with pivoting; false
    /// if A is singular to rounding. Column-major, n x n.
    bool solve_in_place(std::vector<Complex> a, std::vector<Complex> &b, const unsigned int n)
    {
      double size = 0;
      for (const Complex &entry : a)
        size = std::max(size, std::abs(entry));
      for (unsigned int k = 0; k < n; ++k)
      {
        unsigned int pivot = k;
        for (unsigned int i = k + 1; i < n; ++i)
          if (std::abs(a[i + n * k]) > std::abs(a[pivot + n * k]))
            pivot = i;
        if (std::abs(a[pivot + n * k]) <= 1e-10 * size)
          return false;
        for (unsigned int j = 0; j < n; ++j)
        {
          std::swap(a[k + n * j], a[pivot + n * j]);
          std::swap(b[k + n * j], b[pivot + n * j]);
        }
        for (unsigned int i = 0; i < n; ++i)
          if (i != k)
          {
            const Complex factor = a[i + n * k] / a[k + n * k];
            for (unsigned int j = 0; j < n; ++j)
            {
              a[i + n * j] -= factor * a[k + n * j];
              b[i + n * j] -= factor * b[k + n * j];
            }
          }
      }
      for (unsigned int i = 0; i < n; ++i)
        for (unsigned int j = 0; j < n; ++j)
          b[i + n * j] /= a[i + n * i];
      return true;
    }

    /// Modes whose eigenvalues are equal up to a relative difference, two and more.
    std::vector<std::vector<unsigned int>> clusters_of(const std::vector<Complex> &lambda,
                                                       const double tolerance)
    {
      std::vector<std::vector<unsigned int>> clusters;
      std::vector<bool> done(lambda.size(), false);
      for (unsigned int first = 0; first < lambda.size(); ++first)
      {
        std::vector<unsigned int> cluster;
        for (unsigned int j = first; j < lambda.size(); ++j)
          if (!done[j] &&
              std::abs(lambda[j] - lambda[first]) <= tolerance * std::abs(lambda[first]))
            cluster.push_back(j);
        for (const unsigned int j : cluster)
          done[j] = true;
        if (cluster.size() > 1)
          clusters.push_back(std::move(cluster));
      }
      return clusters;
    }

    /// The columns x_b of a cluster become sum_b c_ba x_b; c column-major.
    void recombine(const std::vector<unsigned int> &cluster, const std::vector<Complex> &c,
                   ComplexMultiVector &x)
    {
      const unsigned int m = cluster.size();
      std::vector<Complex> row(m);
      for (unsigned int i = 0; i < x.n_local(); ++i)
      {
        for (unsigned int b = 0; b < m; ++b)
          row[b] = x(i, cluster[b]);
        for (unsigned int a = 0; a < m; ++a)
        {
          Complex sum = 0;
          for (unsigned int b = 0; b < m; ++b)
            sum += c[b + m * a] * row[b];
          x.set(i, cluster[a], sum);
        }
      }
    }

    /// Makes the vectors of equal eigenvalues of a self-adjoint problem orthonormal in M, by
    /// Gram-Schmidt on their coefficients: their condition numbers are 1 then.
    void orthonormalise_clusters(const QuadraticEigenproblem &problem, EigenPairs &modes)
    {
      for (const std::vector<unsigned int> &cluster : clusters_of(modes.lambda, 1e-9))
      {
        const unsigned int m            = cluster.size();
        const ComplexMultiVector x      = modes.right.columns(cluster);
        const std::vector<Complex> gram = sesquilinear_form(x, problem.M, x);
        std::vector<Complex> c(m * m);
        const auto product = [&](const unsigned int a, const unsigned int b)
        {
          Complex sum = 0;
          for (unsigned int i = 0; i < m; ++i)
            for (unsigned int j = 0; j < m; ++j)
              sum += std::conj(c[i + m * a]) * gram[i + m * j] * c[j + m * b];
          return sum;
        };
        for (unsigned int a = 0; a < m; ++a)
        {
          c[a + m * a] = 1;
          for (unsigned int pass = 0; pass < 2; ++pass)
            for (unsigned int b = 0; b < a; ++b)
            {
              const Complex part = product(b, a);
              for (unsigned int i = 0; i < m; ++i)
                c[i + m * a] -= part * c[i + m * b];
            }
          const double length = std::sqrt(product(a, a).real());
          for (unsigned int i = 0; i < m; ++i)
            c[i + m * a] /= length;
        }
        recombine(cluster, c, modes.right);
      }
    }

    /// Makes the left vectors of (almost) equal eigenvalues biorthogonal to the right ones: with
    /// C = Z^H [2 l M + P] X of a cluster, Z := Z C^{-H}. A defective cluster, singular C, is left
    /// alone: its condition is infinite.
    void biorthogonalise_clusters(const QuadraticEigenproblem &problem, EigenPairs &modes)
    {
      for (const std::vector<unsigned int> &cluster : clusters_of(modes.lambda, 1e-7))
      {
        const unsigned int m        = cluster.size();
        const EigenPairs of_cluster = modes.select(cluster);
        const auto form             = biorthogonality(problem, of_cluster, of_cluster);
        // X C^H = I for the coefficients X^H of the new left vectors
        std::vector<Complex> c_adjoint(m * m), coefficients(m * m);
        for (unsigned int a = 0; a < m; ++a)
        {
          coefficients[a + m * a] = 1;
          for (unsigned int b = 0; b < m; ++b)
            c_adjoint[a + m * b] = std::conj(form[b + m * a]);
        }
        if (!solve_in_place(c_adjoint, coefficients, m))
          continue;
        recombine(cluster, coefficients, modes.left);
      }
    }

  } // namespace

  QuadraticEigenproblem adjoint_of(const QuadraticEigenproblem &problem)
  {
    QuadraticEigenproblem adjoint = problem.of_same_unknowns();
    adjoint.M                     = problem.M.view(false);
    adjoint.P                     = problem.P.view(true);
    adjoint.Q                     = problem.Q.view(true);
    for (const FrozenTerm &term : problem.frozen)
      adjoint.frozen.push_back(
          {term.coefficient, term.matrix.view(true), term.factor, term.frequency});
    adjoint.reference              = problem.reference.view(false);
    adjoint.make_shifted_reference = problem.make_shifted_reference;
    return adjoint;
  }

  void attach_left_vectors(const QuadraticEigenproblem &problem, EigenPairs transposed_pairs,
                           EigenPairs &modes)
  {
    modes.left = std::move(transposed_pairs.right); // z = conj(y)
    modes.left.conjugate();
    modes.left_backward_error = std::move(transposed_pairs.backward_error);
    biorthogonalise_clusters(problem, modes);
  }

  namespace
  {
    /// Selects the adjoint problem's pairs whose eigenvalues are nearest to the modes', in their
    /// order: Q(l)^T y = 0 with the same l.
    EigenPairs partners_of(const EigenPairs &modes, const EigenPairs &adjoint_pairs)
    {
      const unsigned int n = modes.size();
      if (adjoint_pairs.size() < n)
        throw SolverError("The transposed problem has " + std::to_string(adjoint_pairs.size()) +
                              " eigenvalues where the problem has " + std::to_string(n) +
                              ": left vectors are missing.",
                          {Failure::left_vectors_missing});
      return adjoint_pairs.select(nearest_partners(modes.lambda, adjoint_pairs.lambda));
    }

    /// Without modes there is nothing to do; the left vectors of a self-adjoint problem are the
    /// right ones.
    bool is_trivial(const QuadraticEigenproblem &problem, EigenPairs &modes)
    {
      if (modes.empty())
        modes.left = ComplexMultiVector(problem.rows, 0);
      else if (!problem.has_reference())
      {
        orthonormalise_clusters(problem, modes);
        modes.left                = modes.right;
        modes.left_backward_error = modes.backward_error;
        biorthogonalise_clusters(problem, modes);
      }
      else
        return false;
      return true;
    }
  } // namespace

  void add_left_vectors(const QuadraticEigenproblem &problem, const ShiftInvert &transposed,
                        const double radius, const EigensolverOptions &options,
                        EigenSolution &solution)
  {
    EigenPairs &modes = solution.modes;
    if (is_trivial(problem, modes))
      return;
    options.progress("  left vectors");
    const QuadraticEigenproblem adjoint = adjoint_of(problem);
    MultiVector start = krylov_basis(adjoint, transposed, 5 * modes.size() + 40, 2);
    solution.cost.n_solves += start.n_columns();
    const EigenSolution found = refine_eigenpairs(adjoint, transposed, std::move(start),
                                                  modes.lambda, radius, true, options);
    solution.cost.n_solves += found.cost.n_solves;
    attach_left_vectors(problem, partners_of(modes, found.modes), modes);
  }

  void search_left_vectors(const QuadraticEigenproblem &problem, const ShiftInvert &transposed,
                           const BlockSearchOptions &search, const EigensolverOptions &options,
                           EigenSolution &solution)
  {
    if (is_trivial(problem, solution.modes))
      return;
    options.progress("  left vectors");
    const QuadraticEigenproblem adjoint = adjoint_of(problem);
    EigenSolution found = block_krylov_search(adjoint, transposed, search, options.progress);
    solution.cost.n_solves += found.cost.n_solves;
    EigenPairs partners     = partners_of(solution.modes, found.modes);
    partners.backward_error = BackwardError(adjoint)(partners);
    // Where the space was exhausted by rounding, vectors that have eigenvalues to the last digit
    // may have contact pressures that are noise.
    EigensolverOptions refinement = options;
    refinement.tolerance          = std::max(options.tolerance, search.tolerance);
    const double worst =
        *std::max_element(partners.backward_error.begin(), partners.backward_error.end());
    if (worst > refinement.tolerance)
    {
      if (!search.region.is_disc()) // the factors are those of another problem
        throw SolverError(text_of("The left vectors of the modes of the window have backward "
                                  "errors up to ",
                                  worst, "."),
                          {Failure::modes_inaccurate});
      EigenSolution refined =
          refine_eigenpairs(adjoint, transposed, partners.right.real_span(), solution.modes.lambda,
                            search.region.radius, true, refinement);
      solution.cost.n_solves += refined.cost.n_solves;
      partners = std::move(refined.modes);
    }
    attach_left_vectors(problem, std::move(partners), solution.modes);
  }

  void complete_left_vectors(const QuadraticEigenproblem &problem, EigenPairs &modes)
  {
    if (is_trivial(problem, modes))
      return;
    EigenPairs transposed_pairs;
    transposed_pairs.lambda = modes.lambda;
    transposed_pairs.right  = std::move(modes.left); // y = conj(z)
    transposed_pairs.right.conjugate();
    transposed_pairs.backward_error = BackwardError(adjoint_of(problem))(transposed_pairs);
    attach_left_vectors(problem, std::move(transposed_pairs), modes);
  }
} // namespace squeal
