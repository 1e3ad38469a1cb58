#pragma once

#include <squeal/reduction/branches.h>
#include <squeal/reduction/reduced_sectors.h>

namespace squeal
{
  /// The modes of a model at many values of its parameters: by projection near an expansion point,
  /// a value with a full solution, and by a full solution where that cannot be certified.
  ///
  /// Modes come as coordinates in the bases or as whole vectors; all that is done with them here
  /// takes either. With relaxation every value has its full solution.
  class ModeTracker
  {
  public:
    ModeTracker(const EigensolverOptions &options, ModeSolver solver);

    /// Another model with a mesh of its own. The old expansion point is forgotten.
    void set_model(Model &model);

    /// What is to be found: all modes of the window, or for steps on the way to such a value only
    /// those in the search disc, without what grows outside (growth_search.h).
    enum class Scope
    {
      window,
      disc
    };
    /// Assembles the model and solves. Throws SolverError, InputError.
    EigenSolution solve(const Parameters::All &parameters, Scope scope = Scope::window);
    /// Solves without projection; the result depends on the parameters only, not on what was solved
    /// before.
    EigenSolution solve_fully(const Parameters::All &parameters, Scope scope = Scope::window);
    /// Makes a full solution for these parameters the expansion point. Modes in coordinates become
    /// invalid.
    void set_expansion_point(const Parameters::All &parameters,
                             const EigenSolution::Reuse &solution);

    /// Whether values can be solved by projection. What has failed for a reason that lasts, such as
    /// a coefficient that was not known to vary, waits for the next expansion point.
    bool has_expansion_point() const
    {
      return reduced.has_expansion_point();
    }
    /// Before the first solution about an expansion point: learns which terms are to vary.
    void look_at(const Parameters::All &parameters);

    /// Parameters will come scattered, not along a path. Before the first expansion point.
    void expect_scattered()
    {
      reduced.expect(ReducedModel::Course::scattered);
    }
    /// Whether the bases of the projection have become so large that it is time for restart().
    bool is_crowded() const
    {
      return reduced.is_crowded();
    }
    /// Whether the bases cannot take the corrections of another solution.
    bool is_full() const
    {
      return reduced.is_full();
    }
    /// Bases of the last solutions only, of scattered ones of their principal components. Modes in
    /// coordinates become invalid, but for these, which are given in the new ones.
    EigenPairs restart(const EigenPairs &modes)
    {
      ++n_restarts_;
      if (!is_whole(modes))
        return reduced.restart(modes);
      reduced.restart({});
      return modes;
    }
    unsigned int n_restarts() const
    {
      return n_restarts_;
    }

    /// The expansion point's terms that vary: part of the state of a run that is to be resumed.
    std::vector<double> varying_terms() const
    {
      return reduced.varying_terms();
    }
    void keep_apart(const std::vector<double> &varying_terms)
    {
      reduced.keep_apart(varying_terms);
    }

    bool is_whole(const EigenPairs &modes) const
    {
      return !ReducedModel::is_reduced(modes, whole_rows);
    }
    EigenPairs whole(const EigenPairs &modes) const
    {
      EigenPairs result = in_their_phases(modes);
      turn_to_real(result); // a projection leaves any phase; real modes are to have real vectors
      return result;
    }

    /// The functions of stability.h and branches.h, for modes of the last solution.
    std::vector<ModeRow> analyse(const EigenPairs &modes) const;
    /// Nothing if the model cannot be differentiated by the parameter.
    std::vector<std::complex<double>> sensitivities(const std::string &parameter,
                                                    const EigenPairs &modes) const;
    /// transition_of(), column-major. @p before may be older than the last expansion point only if
    /// it is whole.
    std::vector<std::complex<double>> transition(const EigenPairs &before,
                                                 const EigenPairs &next) const;

    /// The effects of the discretisation on a solution for these parameters.
    ErrorEffects estimate_errors(const ErrorEstimator &estimator, const Parameters::All &parameters,
                                 const EigenPairs &modes, const EigenSolution::Reuse &solution);

    /// Assembles the model and gives the whole problem, to which whole modes belong.
    const QuadraticEigenproblem &assemble(const Parameters::All &parameters);
    /// Gives the whole problem of infinitely slow motions, l = 0: with relaxed moduli.
    const QuadraticEigenproblem &assemble_at_rest(const Parameters::All &parameters);
    std::vector<ParameterDerivative> derivatives(const std::string &parameter) const
    {
      return model->derivatives(parameter, reduced.inverse());
    }

    /// Contacts and other constraints that hold at the parameters of now.
    unsigned int n_constraints() const
    {
      return model->equations().n_constraints;
    }
    unsigned int n_full_solutions() const
    {
      return n_full;
    }
    /// Processor seconds of this rank; assembly has the contact and the static states, also those
    /// of full solutions.
    struct Seconds
    {
      double assembly = 0, counting = 0, projection = 0, full = 0, bars = 0;
    };
    const Seconds &seconds() const
    {
      return seconds_;
    }

  private:
    void assemble_model(const Parameters::All &parameters, const LinearOperator &nearby);
    EigenPairs in_their_phases(const EigenPairs &modes) const
    {
      return is_whole(modes) ? modes : reduced.expand(modes);
    }
    /// Unless that is how the model is assembled now.
    void assemble_again(const Parameters::All &parameters, const EigenSolution::Reuse &solution);
    /// Sums the model as it is assembled now; relaxation is frozen as in find_modes().
    const QuadraticEigenproblem &whole_problem() const;
    /// Whether the reference problem has as many modes in the disc as the expansion point's.
    bool has_count_of_expansion_point();

    Model *model = nullptr;
    EigensolverOptions options;
    const ModeSolver solver;
    ReducedSectors reduced;
    std::optional<Sectors> sectors; ///< of the model, once asked for
    RowRange whole_rows;
    unsigned int n_full = 0, n_restarts_ = 0;
    Seconds seconds_;
    mutable std::optional<QuadraticEigenproblem> summed; ///< whole_problem(), if asked for
    std::optional<QuadraticEigenproblem> at_rest;        ///< assemble_at_rest(), with relaxation
    unsigned int n_assemblies = 0;
  };
} // namespace squeal
