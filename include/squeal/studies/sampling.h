#pragma once

#include <squeal/reduction/branches.h>
#include <squeal/studies/interpolated_effects.h>
#include <squeal/studies/sample_statistics.h>
#include <squeal/studies/study.h>

#include <limits>

namespace squeal
{
  /// Tells how probable it is that a brake squeals whose numbers are uncertain. The modes of each
  /// sample are solved by projection on those of the centre and certified, in full where they do
  /// not certify; they are told apart by the branches of the centre.
  ///
  /// samples.csv has a line for each, probability.csv and indices.csv what follows. Probabilities
  /// have three bars: of the number of samples, of the solver and of the mesh
  /// (InterpolatedEffects).
  class Sampling : public Study
  {
  public:
    Sampling(ParameterFile &file, Model &model, const EigensolverOptions &options,
             const std::string &directory, MPI_Comm comm, Log &log,
             const ErrorEstimator &estimator = {});

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
      /// Takes the largest of this one and another.
      void include(const Growth &other);
      friend void serialize(Archive &archive, Growth &growth)
      {
        archive(growth.value, growth.by_mesh[0], growth.by_mesh[1], growth.by_solver[0],
                growth.by_solver[1]);
      }
    };
    /// Growth rates by branch of the centre, and the largest of all modes: not known where there
    /// are no modes, or no load.
    struct Outcome
    {
      std::vector<Growth> branches;
      Growth largest;
      friend void serialize(Archive &archive, Outcome &outcome)
      {
        archive(outcome.branches, outcome.largest);
      }
    };

    unsigned int n_points() const override
    {
      return points.size();
    }
    /// Solves the centre, estimates effects of the mesh there and beside, and makes it the
    /// expansion point.
    void prepare() override;
    void visit(Archive &state) override
    {
      state(outcomes);
    }
    std::string take_up() override;
    void open(bool resumed) override;
    void solve(unsigned int sample) override;
    bool leave_out(unsigned int sample) override;
    /// Writes probabilities and sensitivity indices.
    void conclude() override;

    /// Gives the medians; of given samples their means.
    Point centre() const;
    void expand_about_centre();
    /// Looks at the largest of each number: which terms vary.
    void learn_terms();
    /// Carries the effects from the centre to the modes of a point.
    KnownEffects effects_at(const Point &point, const BranchPoint &modes) const;
    Fields sample_fields(unsigned int sample, const BranchPoint &modes,
                         const Outcome &outcome) const;
    void write_probabilities() const;
    void write_indices() const;
    /// Lists the growth rates of @p n samples; @p branch, or -1 for the largest of all modes.
    std::vector<double> growth_rates(int branch, unsigned int first, unsigned int n) const;
    Fields probability_fields(int branch) const;
    SensitivityIndices indices_of(int branch, unsigned int parameter) const;
    Fields indices_fields(int branch, unsigned int parameter,
                          const SensitivityIndices &indices) const;
    const Growth &growth_of(unsigned int sample, int branch) const;
    bool has_indices() const;
    /// Counts the samples that have modes; the others are no verdict.
    unsigned int n_with_modes() const;

    const Parameters::Sampling settings;
    std::vector<Point> points;
    Point middle;            ///< centre()
    unsigned int n_base = 0; ///< points A; B and, with indices, A with numbers of B follow
    std::optional<InterpolatedEffects> effects; ///< with the whole modes of the centre
    /// Which number is moved at each place beside the centre, and by how much.
    std::vector<std::pair<unsigned int, double>> moved;
    BranchPoint reduced_centre;
    std::vector<double> frequencies; ///< of the branches at the centre, Hz
    ModesOnCourse reduced_place;
    std::vector<Outcome> outcomes;
    std::unique_ptr<Table> samples_csv;
    bool knows_terms  = false; ///< which of them vary
    bool is_projected = false; ///< once there was an expansion point
    bool was_full     = false; ///< the last sample
  };
} // namespace squeal
