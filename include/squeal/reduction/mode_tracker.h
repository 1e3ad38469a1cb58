#pragma once

#include <squeal/linalg/gmres.h>
#include <squeal/model/model.h>
#include <squeal/reduction/branches.h>
#include <squeal/reduction/sector_model.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// The modes of a model at many values of its parameters: by projection near an expansion point,
  /// a value with a full solution, and by a full solution where that cannot be certified.
  ///
  /// Each sector in which the full solution was found has a reduced model of its own. Modes come as
  /// coordinates in its bases (SectorModes) or as whole vectors; all that is done with them here
  /// takes either. With relaxation every value has its full solution.
  class ModeTracker
  {
  public:
    ModeTracker(const EigensolverOptions &options, ModeSolver solver);
    /// What inverse() gives refers to it.
    ModeTracker(const ModeTracker &)            = delete;
    ModeTracker &operator=(const ModeTracker &) = delete;

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
    bool has_expansion_point() const;
    /// Before the first solution about an expansion point: learns which terms are to vary.
    void look_at(const Parameters::All &parameters);

    /// Parameters will come scattered, not along a path. Before the first expansion point.
    void expect_scattered()
    {
      course = ReducedModel::Course::scattered;
    }
    /// Whether the bases of the projection have become so large that it is time for restart().
    bool is_crowded() const;
    /// Whether the bases cannot take the corrections of another solution.
    bool is_full() const;
    /// Bases of the last solutions only, of scattered ones of their principal components. Modes in
    /// coordinates become invalid, but for these, which are given in the new ones.
    EigenPairs restart(const EigenPairs &modes);
    unsigned int n_restarts() const
    {
      return counts.restarts;
    }

    /// The expansion point's terms that vary (AffineTerms::varying_terms()): part of the state of a
    /// run that is to be resumed.
    std::vector<double> varying_terms() const;
    void keep_apart(const std::vector<double> &varying_terms);

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
      return model->derivatives(parameter, inverse());
    }

    /// Contacts and other constraints that hold at the parameters of now.
    unsigned int n_constraints() const
    {
      return model->equations().n_constraints;
    }
    unsigned int n_full_solutions() const
    {
      return counts.full;
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
    /// Unless that is how the model is assembled now.
    void assemble_again(const Parameters::All &parameters, const EigenSolution::Reuse &solution);
    /// Sums the model as it is assembled now; relaxation is frozen as in find_modes().
    const QuadraticEigenproblem &whole_problem() const;

    /// x = Q^{-1} b of the expansion point, or of the terms of renew_inverse() for a symmetric b;
    /// empty without. To be used before the next expansion point.
    LinearOperator inverse() const;
    /// Factorises for inverse() the Q of the model, of symmetric vectors if there are parity
    /// sectors: static states are symmetric. Without an effect if it is singular.
    void renew_inverse();

    /// Gives the sectors their parts of the model's terms; false if these do not keep to them.
    bool set_terms();
    bool keep_to_sectors(const std::vector<Term> &terms) const;
    std::vector<RimSurvey::InSector> in_sectors(unsigned int n_constraints) const;
    /// Whether the reference problems have as many modes in the disc as those of the expansion
    /// point. False also if the terms have lost the symmetry.
    bool has_count_of_expansion_point();
    /// Solves in every sector (ReducedModel::solve()). Nothing either where strongly damped modes
    /// may have come into the disc (RimSurvey).
    std::optional<EigenPairs> solve_by_projection();
    /// Makes one list of modes by sector.
    EigenPairs list_of(std::vector<EigenPairs> found) const;

    std::vector<SectorModes> by_sector(const EigenPairs &modes) const;
    unsigned int largest_dimension() const;
    /// Whole vectors, not turned.
    EigenPairs in_their_phases(const EigenPairs &modes) const;
    /// biorthogonality() of two lists in coordinates; zero between sectors.
    std::vector<std::complex<double>> reduced_form(const EigenPairs &of_left,
                                                   const EigenPairs &of_right) const;

    Model *model = nullptr;
    EigensolverOptions options;
    const ModeSolver solver;
    ReducedModel::Course course = ReducedModel::Course::path;
    std::optional<Sectors> sectors; ///< of the model, once asked for
    RowRange whole_rows;
    std::vector<SectorModel> parts;
    RimSurvey rim;
    /// Whether nothing grows outside of the disc at the expansion point, as far as there are signs.
    bool no_growth_beyond = false;
    std::array<double, 3> norms{}; ///< of the expansion point's matrices by order
    struct Counts
    {
      unsigned int full = 0, restarts = 0, assemblies = 0;
      unsigned int inverse = 0; ///< solutions with factors nearby
    };
    mutable Counts counts;
    Seconds seconds_;
    mutable std::optional<QuadraticEigenproblem> summed; ///< whole_problem(), if asked for
    std::optional<QuadraticEigenproblem> at_rest;        ///< assemble_at_rest(), with relaxation
  };
} // namespace squeal
