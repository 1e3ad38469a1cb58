#include <squeal/base/memory.h>
#include <squeal/eigen/find_modes.h>
#include <squeal/mesh/cell_map.h>
#include <squeal/model/matrix_free_modes.h>

#include <algorithm>
#include <cmath>
#include <sstream>

namespace squeal
{
  namespace
  {
    /// The displacements of columns of one space in another one on the same mesh; no pressures.
    template <int dim>
    MultiVector interpolate(const FiniteElementSpace<dim> &from, const FiniteElementSpace<dim> &to,
                            const MultiVector &columns)
    {
      const CellMap<dim> given(from), wanted(to);
      const DenseMatrix values  = interpolation(from.fe, to.fe);
      const unsigned int n_from = values.n_columns, n_to = values.n_rows;
      const std::vector<Column> seen = given.import(columns);
      MultiVector result(to.rows, columns.n_columns());
      DenseMatrix at_cell((dim + 1) * n_from, columns.n_columns());
      for (unsigned int cell = 0; cell < wanted.cells.size(); ++cell)
      {
        given.gather(cell, seen, at_cell);
        for (const typename CellMap<dim>::Entry &entry : wanted.cells[cell])
        {
          const unsigned int component = entry.unknown / n_to, node = entry.unknown % n_to;
          if (component == dim || !entry.direct || entry.index >= to.rows.n_local())
            continue;
          for (unsigned int k = 0; k < columns.n_columns(); ++k)
          {
            double sum = 0;
            for (unsigned int a = 0; a < n_from; ++a)
              sum += values(node, a) * at_cell(component * n_from + a, k);
            result.column(k)[entry.index] = sum;
          }
        }
      }
      return result;
    }

    /// [Re x, Im x, Re z, Im z].
    MultiVector right_and_left(const EigenPairs &modes)
    {
      MultiVector columns = modes.right.re;
      for (const MultiVector *block : {&modes.right.im, &modes.left.re, &modes.left.im})
        columns.append(*block);
      return columns;
    }

    /// The modes of one degree less.
    struct Start
    {
      MultiVector vectors; ///< right and left ones, Re and Im, in the space of the model
      std::vector<double> frequencies; ///< Im l, ascending
    };

    template <int dim>
    Start find_start(const BrakeModel<dim> &model, const EigensolverOptions &options)
    {
      Parameters::All parameters = model.parameters();
      --parameters.discretization.degree;
      parameters.eigenproblem.solver              = ModeSolver::block_krylov;
      parameters.eigenproblem.error_bars          = false;
      parameters.static_equilibrium.linear_solver = LinearSolver::direct;
      PhaseTimer timer; // all of it belongs to the phase of the caller
      BrakeModel<dim> lower(model, parameters, timer);
      lower.distribute();
      lower.assemble(parameters);
      const EigenSolution found =
          find_modes(parameters.eigenproblem.solver, lower.equations(), options, lower.sectors());
      Start start;
      for (const std::complex<double> &l : found.modes.lambda)
        start.frequencies.push_back(l.imag());
      start.vectors = interpolate(lower.spaces(), model.spaces(), right_and_left(found.modes));
      return start;
    }

    /// The largest factor by which the degree lowers a frequency, mode by mode in their order: more
    /// unknowns lower all of them, so that the k-th of few unknowns is above the k-th of many.
    double largest_ratio(const std::vector<double> &of_lower_degree,
                         const std::vector<std::complex<double>> &lambda)
    {
      std::vector<double> found;
      for (const std::complex<double> &l : lambda)
        if (l.imag() > 0)
          found.push_back(l.imag());
      std::sort(found.begin(), found.end());
      double ratio = 1;
      for (unsigned int k = 0; k < std::min(found.size(), of_lower_degree.size()); ++k)
        ratio = std::max(ratio, of_lower_degree[k] / found[k]);
      return ratio;
    }
  } // namespace

  template <int dim>
  EigenSolution find_modes_without_factors(const BrakeModel<dim> &model,
                                           const EigensolverOptions &options)
  {
    const std::string lower_degree = std::to_string(model.parameters().discretization.degree - 1);
    const auto start_up_to         = [&](const double factor)
    {
      options.progress("  modes of degree " + lower_degree);
      EigensolverOptions wider = options;
      wider.max_imaginary      = factor * options.max_imaginary;
      Start start              = find_start(model, wider);
      return_freed_memory();
      return start;
    };
    // Elements of degree 1 lock in bending: their frequencies are far too high.
    double reach = model.parameters().discretization.degree == 2 ? 2. : 1.3;
    Start start  = start_up_to(reach);
    // Without any mode nothing tells how far the degree lowers frequencies.
    for (constexpr double widest = 20; start.frequencies.empty() && reach < widest;)
      start = start_up_to(reach *= 2);
    const DavidsonProblem problem       = model.davidson_problem();
    constexpr unsigned int max_attempts = 4;
    unsigned int n_cycles               = 0;
    for (unsigned int attempt = 0; attempt < max_attempts; ++attempt)
    {
      constexpr double slack = 1.05;
      double ratio           = 1;
      const auto note        = [&](const EigenSolution &solution)
      {
        ratio = std::max(ratio, largest_ratio(start.frequencies, solution.modes.lambda));
        n_cycles += solution.cost.n_solves;
      };
      const auto suffices = [&](const EigenSolution &solution)
      {
        const std::vector<std::complex<double>> &lambda = solution.modes.lambda;
        const auto is_inside                            = [&](const std::complex<double> &l)
        { return l.imag() <= options.max_imaginary; };
        return slack * ratio <= reach &&
               std::size_t(std::count_if(lambda.begin(), lambda.end(), is_inside)) <=
                   start.frequencies.size();
      };
      // Eigenvalues to a percent tell how far the degree moves them, and good neighbours above the
      // window make the modes in it converge faster. All are corrected, because any may be one of
      // the window.
      EigensolverOptions rough = options;
      rough.tolerance          = std::max(1e-2, options.tolerance);
      rough.max_imaginary      = reach * options.max_imaginary;
      EigenSolution solution   = block_davidson(problem, std::move(start.vectors), rough);
      MultiVector found        = right_and_left(solution.modes);
      note(solution);
      if (suffices(solution))
      {
        solution = block_davidson(problem, found, options);
        note(solution);
        if (suffices(solution))
        {
          std::ostringstream text;
          text << "not proven without factors. " << start.frequencies.size() << " modes of degree "
               << lower_degree << " up to " << options.max_imaginary * reach / (2 * M_PI)
               << " Hz, proven complete, were corrected; the degree lowers frequencies by up to "
               << 100 * (1 - 1 / ratio) << " %, and for " << 100 * (1 - 1 / reach)
               << " % there were modes at hand";
          solution.proof.completeness = text.str();
          solution.cost.n_solves      = n_cycles;
          normalise(problem.equations, solution.modes);
          return solution;
        }
      }
      reach = 1.1 * std::max(reach, slack * ratio);
      start = start_up_to(reach);
      start.vectors.append(found);
    }
    throw SolverError("Elements of degree " + lower_degree +
                          " are so far off that modes may be missing.",
                      {Failure::degree_too_low});
  }

  template EigenSolution find_modes_without_factors(const BrakeModel<2> &,
                                                    const EigensolverOptions &);
  template EigenSolution find_modes_without_factors(const BrakeModel<3> &,
                                                    const EigensolverOptions &);
} // namespace squeal
