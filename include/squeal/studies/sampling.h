#pragma once

#include <squeal/assessment/tables.h>
#include <squeal/reduction/branches.h>
#include <squeal/studies/interpolated_effects.h>
#include <squeal/studies/parameter_study.h>
#include <squeal/studies/sample_statistics.h>

#include <chrono>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace squeal
{
  /// How probable it is that a brake squeals whose numbers are uncertain. The modes of each sample
  /// are solved by projection on those of the centre and certified, in full where they do not
  /// certify; they are told apart by the branches of the centre.
  ///
  /// samples.csv has a line for each, probability.csv and indices.csv what follows. Probabilities
  /// have three bars: of the number of samples, of the solver and of the mesh
  /// (InterpolatedEffects).
  class Sampling
  {
  public:
    Sampling(ParameterFile &file, Model &model, const EigensolverOptions &options,
             const std::string &directory, MPI_Comm comm, Log &log,
             const ErrorEstimator &estimator = {});

    /// Throws InputError, SolverError.
    void run();

  private:
    using Point = std::vector<double>;

    /// A growth rate and what its errors let it be at least and at most.
    struct Growth
    {
      double value      = std::numeric_limits<double>::quiet_NaN();
      double by_mesh[2] = {value, value}, by_solver[2] = {value, value};

      bool is_known() const
      {
        return value == value;
      }
      /// The largest of several.
      void include(const Growth &other);
    };
    /// By branch of the centre, and the largest of all modes.
    struct Outcome
    {
      std::vector<Growth> branches;
      Growth largest;
    };

    void make_points();
    Point centre() const;
    /// Solves the centre, estimates effects of the mesh there and beside, and makes it the
    /// expansion point.
    void prepare();
    void expand_about_centre();
    void learn_terms();
    Outcome solve(unsigned int sample);
    /// The effects on the modes of a point, carried from the centre.
    KnownEffects effects_at(const Point &point, const BranchPoint &modes) const;
    void write_sample(unsigned int sample, const BranchPoint &modes, const Outcome &outcome);
    Fields sample_fields(unsigned int sample, const BranchPoint &modes,
                         const Outcome &outcome) const;
    void save();
    bool resume();
    void write_results();
    /// Of these samples; @p branch, or -1 for the largest of all modes.
    std::vector<double> growth_rates(int branch, unsigned int first, unsigned int n) const;
    Fields probability_fields(int branch) const;
    SensitivityIndices indices_of(int branch, unsigned int parameter) const;
    Fields indices_fields(int branch, unsigned int parameter,
                          const SensitivityIndices &indices) const;
    const Growth &growth_of(unsigned int sample, int branch) const;
    bool has_indices() const;
    void tell_progress(unsigned int n_before);

    ParameterStudy study;
    ModeTracker &tracker;
    const Parameters::Sampling settings;
    Log &log;
    const ErrorEstimator &estimator;
    std::vector<Point> points;
    Point middle;            ///< centre()
    unsigned int n_base = 0; ///< points A; B and, with indices, A with numbers of B follow
    std::optional<InterpolatedEffects> effects; ///< with the whole modes of the centre
    /// Of each place beside the centre: which number is moved there, and by how much.
    std::vector<std::pair<unsigned int, double>> moved;
    BranchPoint reduced_centre;
    std::vector<double> frequencies; ///< of the branches at the centre, Hz
    ModesOnCourse reduced_place;
    std::vector<Outcome> outcomes;
    std::unique_ptr<Table> samples_csv;
    std::chrono::steady_clock::time_point begin, last_saved;
    bool knows_terms  = false; ///< which of them vary
    bool is_projected = false; ///< once there was an expansion point
    bool was_full     = false; ///< the last sample
  };
} // namespace squeal
