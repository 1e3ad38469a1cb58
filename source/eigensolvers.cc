#include <squeal/dense.h>
#include <squeal/eigensolvers.h>

#include <slepcpep.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

namespace squeal
{
  using Complex = std::complex<double>;

  BackwardError::BackwardError(const QuadraticEigenproblem &problem)
      : problem(problem), norm_m(problem.M.infinity_norm()), norm_p(problem.P.infinity_norm()),
        norm_q(problem.Q.infinity_norm())
  {
  }

  BackwardError::Result BackwardError::operator()(const std::vector<Complex> &lambda,
                                                  const Block &re, const Block &im) const
  {
    const Block m_re = multiply(problem.M, re), m_im = multiply(problem.M, im);
    const Block p_re = multiply(problem.P, re), p_im = multiply(problem.P, im);
    Result result{multiply(problem.Q, re), multiply(problem.Q, im), {}};

    std::vector<double> largest(2 * lambda.size());
    for (unsigned int j = 0; j < lambda.size(); ++j)
    {
      const Complex l = lambda[j], l2 = l * l;
      for (unsigned int i = 0; i < re.n_local(); ++i)
      {
        const Complex r = l2 * Complex(m_re.column(j)[i], m_im.column(j)[i]) +
                          l * Complex(p_re.column(j)[i], p_im.column(j)[i]) +
                          Complex(result.re.column(j)[i], result.im.column(j)[i]);
        result.re.column(j)[i] = r.real();
        result.im.column(j)[i] = r.imag();
        largest[2 * j]         = std::max(largest[2 * j], std::abs(r));
        largest[2 * j + 1] =
            std::max(largest[2 * j + 1], std::abs(Complex(re.column(j)[i], im.column(j)[i])));
      }
    }
    MPI_Allreduce(MPI_IN_PLACE, largest.data(), largest.size(), MPI_DOUBLE, MPI_MAX,
                  problem.rows.comm);
    for (unsigned int j = 0; j < lambda.size(); ++j)
    {
      const double size = std::norm(lambda[j]) * norm_m + std::abs(lambda[j]) * norm_p + norm_q;
      result.errors.push_back(largest[2 * j] / (size * largest[2 * j + 1]));
    }
    return result;
  }

  namespace
  {
    /// A zero eigenvalue of a body that is free to move is defective, so rounding spreads it to
    /// sqrt(eps).
    double rigid_body_limit(const double max_imaginary)
    {
      return 1e-5 * max_imaginary;
    }

    unsigned int count_rigid_body_modes(const QuadraticEigenproblem &problem,
                                        const EigensolverOptions &options)
    {
      return problem.may_move_rigidly
                 ? count_reference_modes(problem, rigid_body_limit(options.max_imaginary))
                 : 0;
    }

    /// |l| up to which solvers search: the window is a strip |Im l| <= w, the search region this
    /// disc. A mode of the strip outside of it has a damping ratio above 0.4 and cannot squeal.
    double search_radius(const double max_imaginary)
    {
      return 1.1 * max_imaginary;
    }

    /// Sorts, normalises and turns the modes; keeps those inside the window.
    Modes finish(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                 Modes modes)
    {
      std::vector<unsigned int> order;
      unsigned int n_zero = 0;
      for (unsigned int j = 0; j < modes.lambda.size(); ++j)
        if (std::abs(modes.lambda[j]) <= rigid_body_limit(options.max_imaginary))
          ++n_zero;
        else if (modes.lambda[j].imag() <= options.max_imaginary &&
                 (modes.lambda[j].imag() > 0 || modes.lambda[j].real() > 0))
          order.push_back(j); // real eigenvalues only if they diverge
      std::sort(order.begin(), order.end(),
                [&](const unsigned int a, const unsigned int b)
                {
                  return std::make_pair(modes.lambda[a].imag(), modes.lambda[a].real()) <
                         std::make_pair(modes.lambda[b].imag(), modes.lambda[b].real());
                });

      Modes result              = modes;
      result.n_rigid_body_modes = modes.n_rigid_body_modes + n_zero / 2;
      result.re = result.im = Block(problem.rows, order.size());
      result.lambda.clear();
      result.backward_error.clear();
      for (unsigned int k = 0; k < order.size(); ++k)
      {
        const unsigned int j = order[k];
        result.lambda.push_back(modes.lambda[j]);
        result.backward_error.push_back(modes.backward_error[j]);
        std::copy_n(modes.re.column(j), problem.rows.n_local(), result.re.column(k));
        std::copy_n(modes.im.column(j), problem.rows.n_local(), result.im.column(k));
      }

      const Block m_re = multiply(problem.M, result.re), m_im = multiply(problem.M, result.im);
      unsigned int n_local = problem.rows.n_local();
      for (unsigned int k = 0; k < order.size(); ++k)
      {
        double *re = result.re.column(k), *im = result.im.column(k);
        double norm_squared = 0;
        // The largest component; ties and ranks are decided by the lowest row.
        struct
        {
          double value;
          int rank;
        } largest{-1., 0};
        MPI_Comm_rank(problem.rows.comm, &largest.rank);
        std::array<double, 2> turn{{1, 0}};
        for (unsigned int i = 0; i < n_local; ++i)
        {
          norm_squared += re[i] * m_re.column(k)[i] + im[i] * m_im.column(k)[i];
          const double size = std::hypot(re[i], im[i]);
          if (size > largest.value * (1 + 1e-8))
          {
            largest.value = size;
            turn          = {{re[i] / size, im[i] / size}};
          }
        }
        MPI_Allreduce(MPI_IN_PLACE, &norm_squared, 1, MPI_DOUBLE, MPI_SUM, problem.rows.comm);
        MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE_INT, MPI_MAXLOC, problem.rows.comm);
        MPI_Bcast(turn.data(), 2, MPI_DOUBLE, largest.rank, problem.rows.comm);
        const Complex factor = std::conj(Complex(turn[0], turn[1])) / std::sqrt(norm_squared);
        for (unsigned int i = 0; i < n_local; ++i)
        {
          const Complex x = factor * Complex(re[i], im[i]);
          re[i]           = x.real();
          im[i]           = x.imag();
        }
      }
      return result;
    }

    /// Approximate eigenpairs that span a real subspace.
    struct Pairs
    {
      std::vector<Complex> lambda;
      Block re, im;
    };

    /// Rayleigh-Ritz on the span of an orthonormal real basis U, tested with Z: all Ritz pairs
    ///     (l^2 Z^T M U + l Z^T P U + Z^T Q U) c = 0,   x = U c,
    /// with Im l >= 0 and |l| <= radius.
    Pairs rayleigh_ritz(const QuadraticEigenproblem &problem, const Block &trial, const Block &test,
                        const double radius, const double shift)
    {
      const unsigned int n = trial.n_columns();
      const auto project   = [&](const Matrix &matrix)
      {
        return matrix ? DenseMatrix(n, n, inner_products(test, multiply(matrix, trial)))
                      : DenseMatrix();
      };
      const std::vector<DensePair> all = quadratic_eigenpairs(
          project(problem.M), project(problem.P), project(problem.Q), shift, radius);

      Pairs pairs;
      std::vector<double> c_re, c_im;
      for (const DensePair &pair : all)
        if (std::abs(pair.lambda) <= radius)
        {
          pairs.lambda.push_back(pair.lambda);
          for (const Complex &c : pair.vector)
          {
            c_re.push_back(c.real());
            c_im.push_back(c.imag());
          }
        }
      pairs.re = combine(trial, c_re, pairs.lambda.size());
      pairs.im = combine(trial, c_im, pairs.lambda.size());
      return pairs;
    }

    /// One step of inverse iteration with the factorisation at the shift s: with m = l - s,
    ///     x := -Q(s)^{-1} (m^2 M + m Q'(s)) x  =  x - Q(s)^{-1} Q(l) x.
    /// It damps what is far outside of the window, and gives multipliers that belong to the
    /// displacements.
    void inverse_iteration(const QuadraticEigenproblem &problem, const Factorization &factorization,
                           const double shift, Pairs &pairs)
    {
      const unsigned int n_pairs = pairs.lambda.size(), n = problem.rows.n_local();
      const Block m_re = multiply(problem.M, pairs.re), m_im = multiply(problem.M, pairs.im);
      const Block p_re = multiply(problem.P, pairs.re), p_im = multiply(problem.P, pairs.im);
      Block right(problem.rows, 2 * n_pairs);
      for (unsigned int j = 0; j < n_pairs; ++j)
      {
        // m^2 M + m (P + 2 s M) = (l^2 - s^2) M + m P
        const Complex c_m = pairs.lambda[j] * pairs.lambda[j] - shift * shift,
                      c_p = pairs.lambda[j] - shift;
        for (unsigned int i = 0; i < n; ++i)
        {
          const Complex r = -c_m * Complex(m_re.column(j)[i], m_im.column(j)[i]) -
                            c_p * Complex(p_re.column(j)[i], p_im.column(j)[i]);
          right.column(2 * j)[i]     = r.real();
          right.column(2 * j + 1)[i] = r.imag();
        }
      }
      const Block x = factorization.solve(right);
      for (unsigned int j = 0; j < n_pairs; ++j)
      {
        std::copy_n(x.column(2 * j), n, pairs.re.column(j));
        std::copy_n(x.column(2 * j + 1), n, pairs.im.column(j));
      }
    }

    /// Multipliers are no part of a subspace: they follow from the displacements.
    void clear_multipliers(const QuadraticEigenproblem &problem, Block &block)
    {
      for (unsigned int k = 0; k < block.n_columns(); ++k)
        std::fill_n(block.column(k) + problem.rows.n_local() - problem.n_local_constraints,
                    problem.n_local_constraints, 0.);
    }

    /// Improves approximate eigenvectors until their backward errors and the last relative changes
    /// of their eigenvalues are below the tolerance. Each step is Rayleigh-Ritz and one inverse
    /// iteration, whose result enlarges the next subspace: block Davidson with the factorisation at
    /// the shift as preconditioner, in real arithmetic.
    ///
    /// The displacements satisfy N^T u = 0, and test vectors must satisfy (N + mu T)^T z = 0 for
    /// the contact pressures to drop out. With friction U itself does not; Z = Q(s)^{-T} M U does,
    /// and is smooth.
    ///
    /// @p start spans the approximate vectors, @p previous holds their eigenvalues inside the
    /// radius. Ritz values without a small residual are no eigenvalues and are left out; fewer
    /// pairs than given are a SolverError.
    Modes polish(const QuadraticEigenproblem &problem, const Factorization &factorization,
                 Block start, std::vector<Complex> previous, const double radius,
                 const double shift, const EigensolverOptions &options)
    {
      const BackwardError backward_error(problem);
      const bool galerkin = problem.n_constraints == 0 || !problem.reference;
      // A Krylov space contains its start vector, which does not satisfy the constraints;
      // Galerkin's test vectors must. One inverse iteration makes them so.
      if (galerkin && problem.n_constraints > 0)
        start = factorization.solve(multiply(problem.M, start));
      clear_multipliers(problem, start);
      Block basis = orthonormalize(std::move(start));
      Modes modes;
      const unsigned int n_wanted = previous.size();
      double worst = 0, change = 0;
      for (unsigned int step = 0; step < 8; ++step)
      {
        Pairs pairs =
            galerkin ? rayleigh_ritz(problem, basis, basis, radius, shift)
                     : rayleigh_ritz(problem, basis,
                                     factorization.solve_transposed(multiply(problem.M, basis)),
                                     radius, shift);
        modes.n_solves += 2 * pairs.lambda.size() + (galerkin ? 0 : basis.n_columns());
        Block next = pairs.re;
        next.append(pairs.im);
        inverse_iteration(problem, factorization, shift, pairs);
        const std::vector<double> errors = backward_error(pairs.lambda, pairs.re, pairs.im).errors;

        // Zero eigenvalues of free bodies are defective and never accurate; they are counted, not
        // polished.
        std::vector<unsigned int> order;
        for (unsigned int j = 0; j < pairs.lambda.size(); ++j)
          if (std::abs(pairs.lambda[j]) > rigid_body_limit(options.max_imaginary))
            order.push_back(j);
        std::sort(order.begin(), order.end(),
                  [&](const unsigned int a, const unsigned int b)
                  { return errors[a] < errors[b]; });
        order.resize(std::min<std::size_t>(order.size(), n_wanted));
        modes.lambda.clear();
        modes.backward_error.clear();
        modes.re = modes.im = Block(problem.rows, order.size());
        for (unsigned int k = 0; k < order.size(); ++k)
        {
          modes.lambda.push_back(pairs.lambda[order[k]]);
          modes.backward_error.push_back(errors[order[k]]);
          std::copy_n(pairs.re.column(order[k]), problem.rows.n_local(), modes.re.column(k));
          std::copy_n(pairs.im.column(order[k]), problem.rows.n_local(), modes.im.column(k));
        }
        worst  = order.empty()
                     ? 0
                     : *std::max_element(modes.backward_error.begin(), modes.backward_error.end());
        change = previous.size() == order.size() ? 0 : 1;
        if (change == 0)
          for (const Complex &l : modes.lambda)
          {
            double nearest = std::abs(l);
            for (const Complex &p : previous)
              nearest = std::min(nearest, std::abs(p - l));
            if (std::abs(l) > rigid_body_limit(options.max_imaginary))
              change = std::max(change, nearest / std::abs(l));
          }
        options.progress("  polishing step " + std::to_string(step) + ": " +
                         std::to_string(order.size()) + " pairs");
        if (order.size() >= n_wanted && worst <= options.tolerance && change <= options.tolerance)
          return modes;
        previous = modes.lambda;

        next.append(pairs.re);
        next.append(pairs.im);
        clear_multipliers(problem, next);
        basis = orthonormalize(std::move(next));
      }
      std::ostringstream message;
      message << "The eigenpairs could not be polished to the tolerance " << options.tolerance
              << ": " << modes.lambda.size() << " of " << n_wanted
              << " pairs, largest backward error " << worst << ", last relative change " << change
              << ". Try a larger Eigenproblem/Tolerance, or the solver dense for a small problem.";
      throw SolverError(message.str());
    }

    /// SLEPc's PEP: TOAR with shift-invert at a real shift, in real arithmetic.
    class Krylov : public Eigensolver
    {
    public:
      Modes solve(const QuadraticEigenproblem &problem,
                  const EigensolverOptions &options) const override;

    private:
      struct Search
      {
        Block vectors;               ///< Re and Im of the converged pairs
        std::vector<Complex> lambda; ///< with Im l >= 0
        double reached        = 0;   ///< every eigenvalue nearer to the shift than this was found
        unsigned int n_solves = 0;
      };
      static Search search(const QuadraticEigenproblem &problem, const Factorization &factorization,
                           double shift, double scale, unsigned int n_wanted, unsigned int seed,
                           const EigensolverOptions &options);
    };

    /// Lets PEP's linear solver use a factorisation that exists already.
    PetscErrorCode apply_factorization(PC pc, Vec x, Vec y)
    {
      void *context = nullptr;
      PetscCall(PCShellGetContext(pc, &context));
      PetscCall(MatSolve(static_cast<const Factorization *>(context)->factor(), x, y));
      return 0;
    }

    PetscErrorCode monitor(PEP, PetscInt, PetscInt n_converged, PetscScalar *, PetscScalar *,
                           PetscReal *, PetscInt n, void *context)
    {
      const auto &progress =
          *static_cast<const std::function<void(const std::string &)> *>(context);
      progress("  krylov: " + std::to_string(n_converged) + " eigenvalues converged, subspace of " +
               std::to_string(n));
      return 0;
    }

    Krylov::Search Krylov::search(const QuadraticEigenproblem &problem,
                                  const Factorization &factorization, const double shift,
                                  const double scale, const unsigned int n_wanted,
                                  const unsigned int seed, const EigensolverOptions &options)
    {
      // With l = shift + scale * m: m^2 scale^2 M + m scale (P + 2 shift M) + Q(shift).
      const RowRange &rows = problem.rows;
      Matrix a1            = sum_of(rows, {{scale, problem.P}, {2 * shift * scale, problem.M}});
      if (!a1) // PEP wants a matrix
      {
        const std::vector<PetscInt> nothing(rows.n_local(), 0);
        a1 = make_matrix(rows, nothing, nothing);
        compress(a1);
      }
      const Matrix a2 = sum_of(rows, {{scale * scale, problem.M}});
      const Matrix a0 =
          shift == 0
              ? Matrix()
              : sum_of(rows, {{1., problem.Q}, {shift, problem.P}, {shift * shift, problem.M}});

      PEP pep = nullptr;
      SQUEAL_PETSC(PEPCreate(rows.comm, &pep));
      const std::unique_ptr<_p_PEP, void (*)(PEP)> owner(pep, [](PEP p) { PEPDestroy(&p); });
      std::array<Mat, 3> matrices = {{shift == 0 ? problem.Q : a0, a1, a2}};
      SQUEAL_PETSC(PEPSetOperators(pep, 3, matrices.data()));
      SQUEAL_PETSC(PEPSetProblemType(pep, PEP_GENERAL));
      SQUEAL_PETSC(PEPSetType(pep, PEPTOAR));
      SQUEAL_PETSC(PEPSetTarget(pep, 0.));
      SQUEAL_PETSC(PEPSetWhichEigenpairs(pep, PEP_TARGET_MAGNITUDE));
      SQUEAL_PETSC(PEPSetTolerances(pep, 1e-9, 1000));
      SQUEAL_PETSC(PEPSetConvergenceTest(pep, PEP_CONV_REL));
      SQUEAL_PETSC(PEPSetDimensions(pep, n_wanted, PETSC_DEFAULT, PETSC_DEFAULT));
      SQUEAL_PETSC(PEPMonitorSet(
          pep, monitor, const_cast<std::function<void(const std::string &)> *>(&options.progress),
          nullptr));
      ST st = nullptr;
      SQUEAL_PETSC(PEPGetST(pep, &st));
      SQUEAL_PETSC(STSetType(st, STSINVERT));
      SQUEAL_PETSC(STSetTransform(st, PETSC_TRUE));
      KSP ksp = nullptr;
      PC pc   = nullptr;
      SQUEAL_PETSC(STGetKSP(st, &ksp));
      SQUEAL_PETSC(KSPSetType(ksp, KSPPREONLY));
      SQUEAL_PETSC(KSPGetPC(ksp, &pc));
      SQUEAL_PETSC(PCSetType(pc, PCSHELL));
      SQUEAL_PETSC(PCShellSetContext(pc, const_cast<Factorization *>(&factorization)));
      SQUEAL_PETSC(PCShellSetApply(pc, apply_factorization));

      // A fixed start vector that does not depend on the number of ranks: two runs give the same
      // digits.
      BV bv              = nullptr;
      PetscRandom random = nullptr;
      SQUEAL_PETSC(PEPGetBV(pep, &bv));
      SQUEAL_PETSC(BVGetRandomContext(bv, &random));
      SQUEAL_PETSC(PetscRandomSetSeed(random, 0x5eed + seed));
      SQUEAL_PETSC(PetscRandomSeed(random));

      SQUEAL_PETSC(PEPSolve(pep));

      PetscInt n_converged = 0, n_iterations = 0;
      PEPConvergedReason reason;
      SQUEAL_PETSC(PEPGetConverged(pep, &n_converged));
      SQUEAL_PETSC(PEPGetIterationNumber(pep, &n_iterations));
      SQUEAL_PETSC(PEPGetConvergedReason(pep, &reason));
      if (reason < 0)
        throw SolverError(
            "SLEPc's PEP (TOAR) stopped after " + std::to_string(n_iterations) + " restarts with " +
            std::to_string(n_converged) + " of " + std::to_string(n_wanted) +
            " eigenvalues (reason " + std::to_string(reason) +
            "). Try a smaller Eigenproblem/Maximum frequency, or another Eigenproblem/Shift.");

      Search result;
      Vec re = nullptr, im = nullptr;
      SQUEAL_PETSC(MatCreateVecs(matrices[0], &re, nullptr));
      SQUEAL_PETSC(VecDuplicate(re, &im));
      for (PetscInt j = 0; j < n_converged; ++j)
      {
        PetscScalar value_re = 0, value_im = 0;
        SQUEAL_PETSC(PEPGetEigenpair(pep, j, &value_re, &value_im, re, im));
        result.reached = std::max(result.reached, scale * std::hypot(value_re, value_im));
        if (value_im < 0)
          continue; // the conjugate spans the same real subspace
        result.lambda.emplace_back(shift + scale * value_re, scale * value_im);
        for (Vec vector : {re, im})
        {
          if (vector == im && value_im == 0)
            continue;
          Block column(rows, 1);
          const PetscScalar *values = nullptr;
          SQUEAL_PETSC(VecGetArrayRead(vector, &values));
          std::copy_n(values, rows.n_local(), column.data());
          SQUEAL_PETSC(VecRestoreArrayRead(vector, &values));
          if (result.vectors.n_columns() == 0)
            result.vectors = Block(rows, 0);
          result.vectors.append(column);
        }
      }
      SQUEAL_PETSC(VecDestroy(&re));
      SQUEAL_PETSC(VecDestroy(&im));
      if (result.vectors.n_columns() == 0)
        result.vectors = Block(rows, 0);
      return result;
    }

    Modes Krylov::solve(const QuadraticEigenproblem &problem,
                        const EigensolverOptions &options) const
    {
      const double radius = search_radius(options.max_imaginary);

      // At shift 0 the position matrix itself is factorised; a rigid body makes it singular.
      const unsigned int n_rigid    = count_rigid_body_modes(problem, options);
      const unsigned int n_expected = count_reference_modes(problem, radius) - n_rigid;
      const double shift            = options.max_imaginary * (options.shift > 0 ? options.shift
                                                               : n_rigid > 0     ? 0.1
                                                                                 : 0.);
      const Matrix shifted =
          shift == 0 ? Matrix()
                     : sum_of(problem.rows,
                              {{1., problem.Q}, {shift, problem.P}, {shift * shift, problem.M}});
      const Factorization factorization(shift == 0 ? problem.Q : shifted, Factorization::Kind::lu,
                                        "the position matrix (for shift-invert)");
      const double reach = std::hypot(radius, shift);

      const auto in_disc = [&](const Complex &l)
      { return std::abs(l) <= radius && std::abs(l) > rigid_body_limit(options.max_imaginary); };
      const auto count_in_disc = [&](const std::vector<Complex> &lambda)
      {
        return std::count_if(lambda.begin(), lambda.end(),
                             [&](const Complex &l) { return in_disc(l) && l.imag() > 0; });
      };

      // Modes come nearest first, so all of the disc are found once one outside of it is.
      unsigned int n_wanted =
          std::min(2 * (n_expected + n_rigid) + 4, 2 * (problem.rows.size - problem.n_constraints));
      const unsigned int n_all = 2 * (problem.rows.size - problem.n_constraints);
      Search found;
      for (unsigned int attempt = 0;; ++attempt)
      {
        found = search(problem, factorization, shift, options.max_imaginary, n_wanted, 0, options);
        if (found.reached > reach || n_wanted >= n_all)
          break;
        if (attempt == 8)
          throw SolverError("The Krylov search did not reach the end of the window after " +
                            std::to_string(n_wanted) +
                            " eigenvalues. Try a smaller "
                            "Eigenproblem/Maximum frequency.");
        n_wanted = std::min(n_all, n_wanted + n_wanted / 2 + 8);
      }

      // The completeness check. Friction and damping move eigenvalues, so near the rim the numbers
      // of the problem and of its reference may differ without anything missing: then an
      // independent search from another start vector decides.
      std::ostringstream completeness;
      const unsigned int n_found  = count_in_disc(found.lambda);
      const std::string reference = problem.reference
                                        ? problem.reference_name
                                        : std::string("the problem itself (it is symmetric)");
      completeness << n_found << " modes with |l| <= 2 pi " << radius / (2 * M_PI)
                   << " Hz; the inertia of " << reference << " proves " << n_expected << " there";
      if (n_found != n_expected)
      {
        Search again =
            search(problem, factorization, shift, options.max_imaginary, n_wanted, 1, options);
        const unsigned int n_again = count_in_disc(again.lambda);
        completeness << "; a second search from another start vector found " << n_again;
        if (n_again > n_found)
          std::swap(found, again);
        Block both = found.vectors;
        both.append(again.vectors);
        found.vectors = both;
        if (n_again != n_found)
          throw SolverError("Two Krylov searches of the same window found " +
                            std::to_string(n_found) + " and " + std::to_string(n_again) +
                            " modes, the reference problem has " + std::to_string(n_expected) +
                            ": modes are missing. Try a smaller Eigenproblem/Tolerance.");
      }

      std::vector<Complex> inside;
      for (const Complex &l : found.lambda)
        if (in_disc(l))
          inside.push_back(l);
      Modes modes = polish(problem, factorization, found.vectors, inside, radius, shift, options);
      modes.n_rigid_body_modes = n_rigid;
      modes.factor_memory_mib  = factorization.memory_mib();
      modes.completeness       = completeness.str();
      return finish(problem, options, std::move(modes));
    }

    /// LAPACK on the whole problem; the oracle of the other solvers.
    class Dense : public Eigensolver
    {
    public:
      Modes solve(const QuadraticEigenproblem &problem,
                  const EigensolverOptions &options) const override
      {
        constexpr unsigned int largest = 3000;
        if (problem.rows.size > largest)
          throw SolverError("The dense solver takes at most " + std::to_string(largest) +
                            " unknowns; this problem has " + std::to_string(problem.rows.size) +
                            ". Use Eigenproblem/Solver = krylov.");
        // Every rank solves the whole problem: the basis of the projection is the identity.
        Block identity(problem.rows, problem.rows.size);
        for (unsigned int row = problem.rows.begin; row < problem.rows.end; ++row)
          identity.column(row)[row - problem.rows.begin] = 1;
        const double radius = search_radius(options.max_imaginary);
        const bool is_free  = count_rigid_body_modes(problem, options) > 0;
        const double shift  = options.max_imaginary * (options.shift > 0 ? options.shift
                                                       : is_free         ? 0.1
                                                                         : 0.);
        options.progress("  dense: " + std::to_string(problem.rows.size) + " unknowns");
        Pairs pairs = rayleigh_ritz(problem, identity, identity, radius, shift);
        Modes modes;
        modes.backward_error = BackwardError(problem)(pairs.lambda, pairs.re, pairs.im).errors;
        modes.lambda         = pairs.lambda;
        modes.re             = std::move(pairs.re);
        modes.im             = std::move(pairs.im);
        for (const double error : modes.backward_error)
          if (error > options.tolerance)
            throw SolverError("The dense solver's backward error is " + std::to_string(error) +
                              ". Try a larger Eigenproblem/Tolerance.");
        modes.completeness = "all eigenvalues were computed";
        return finish(problem, options, std::move(modes));
      }
    };
  } // namespace

  std::unique_ptr<Eigensolver> make_eigensolver(const std::string &name)
  {
    if (name == "krylov")
      return std::make_unique<Krylov>();
    if (name == "dense")
      return std::make_unique<Dense>();
    throw InputError("Eigenproblem/Solver = " + name + ": allowed are krylov and dense.");
  }
} // namespace squeal
