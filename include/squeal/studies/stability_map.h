#pragma once

#include <squeal/studies/interpolated_effects.h>
#include <squeal/studies/study.h>

#include <array>
#include <functional>

namespace squeal
{
  /// Maps the stability of a model over two parameters: map.csv, a line for each point of the grid,
  /// and border.csv, the stability boundaries, curves on which a mode changes between decay and
  /// growth.
  ///
  /// The grid is walked to and fro, so that each point starts from the vectors of a neighbour.
  /// Between neighbours the modes are paired by their eigenvalues; where the growth rate of a pair
  /// changes its sign, Re l = 0 is solved on that line of the grid (det Q = 0 where a real
  /// eigenvalue grows); where the search goes from one mode to another that it meets, the line is
  /// halved. From each such point the curve is continued with steps of at most half a
  /// cell: along its tangent, which the derivatives by both parameters give, and back onto it by
  /// Newton's method along the gradient. The derivatives come from left and right vectors, so the
  /// operators are never differentiated numerically here.
  ///
  /// With an estimator, every point of the grid and of the boundaries has the bar of the mesh
  /// (InterpolatedEffects), from the map's centre and corners: a boundary has a band,
  /// bar(Re l) / |grad Re l| to both sides (theory.md, section 10).
  ///
  /// What is done is on disk after each point of the grid and each curve; a map that was killed
  /// resumes there. At the end map.csv is sorted by the second value and the first.
  class StabilityMap : public Study
  {
  public:
    StabilityMap(ParameterFile &file, Model &model, const EigensolverOptions &options,
                 const std::string &directory, MPI_Comm comm, Log &log,
                 const ErrorEstimator &estimator = {});

  private:
    /// A position in units of the grid's cells, counted from the first values.
    using Position = std::array<double, 2>;

    /// A point of a stability boundary.
    struct BoundaryPoint
    {
      Position at{};
      std::complex<double> lambda;
      /// The last step of Newton's method and what the eigenvalue's own error, by its backward
      /// error and condition, moves the boundary by; cells.
      double search_error = 0, reduction_error = 0;
      bool divergence = false;
      bool done       = false; ///< on a curve that was traced

      /// The unit vector of cells across the boundary, of flutter towards growth; what the mesh
      /// moves the boundary by along it, cells; and how many other modes grow here: all of points
      /// of a curve.
      Position across{};
      std::optional<CriticalBar> bar;
      std::optional<unsigned int> n_growing;

      double accuracy() const
      {
        return search_error + reduction_error;
      }
      /// Hands over what is known of a crossing.
      friend void serialize(Archive &archive, BoundaryPoint &point)
      {
        archive(point.at, point.lambda, point.search_error, point.reduction_error, point.divergence,
                point.done);
      }
    };

    /// The function that vanishes on the boundary, its gradient by position, and what is needed to
    /// go on from there.
    struct Evaluation
    {
      double value = 0;
      Position gradient{};
      double uncertainty = 0; ///< of the value
      std::complex<double> lambda;
      std::array<std::complex<double>, 2> slope{}; ///< dl by position
      EigenPairs modes;                            ///< all that were found, if any were asked for
      unsigned int mode = 0;                       ///< this one's number
    };
    using BoundaryFunction = std::function<Evaluation(const Position &)>;

    unsigned int n_points() const override
    {
      return values[0].size() * values[1].size();
    }
    /// Estimates effects at the centre and the corners of the map.
    void prepare() override;
    void visit(Archive &state) override
    {
      state(eigenvalues, left_out, crossings, n_curves, varying_terms);
    }
    std::string take_up() override;
    void open(bool resumed) override;
    void solve(unsigned int point) override;
    bool leave_out(unsigned int point) override;
    bool can_be_saved() const override
    {
      return is_full;
    }
    /// Traces the boundaries and sorts the map, whose state until then marks how much of it is
    /// right.
    void conclude() override;

    double parameter_at(unsigned int k, double position) const;
    double cell_size(unsigned int k, double position) const;
    std::vector<double> values_at(const Position &at) const
    {
      return {parameter_at(0, at[0]), parameter_at(1, at[1])};
    }
    Position position_of(unsigned int point) const;
    bool inside(const Position &at, double margin) const;
    /// Cuts the way to a position at the edge of the map; the coordinate that is constant on that
    /// edge, or -1.
    int clip(const Position &from, Position &to) const;

    void set_expansion_point(const Position &at, ModeTracker::Scope scope);
    Evaluation evaluate(const Position &at, std::complex<double> expected);
    Evaluation evaluate(const Position &at, const StaticInstability &instability);

    /// Shares of the corners, anticlockwise from the first values, in the triangle of the centre
    /// and two neighbouring ones in which a position lies.
    std::vector<double> shares_at(const Position &at) const;
    Fields map_fields(const Position &at, const GrowthSummary &summary) const;
    Fields border_fields(unsigned int curve, const BoundaryPoint &point) const;
    void write(const Position &at, const EigenPairs &modes);
    /// Puts the lines of map.csv, which was walked to and fro, in order.
    void sort_map() const;
    /// The crossings between two neighbours of the grid, of which the second has just been solved.
    void find_crossings(unsigned int before, unsigned int now, const EigenPairs &modes);
    /// Points of the boundary between two points of a line with these eigenvalues. Where modes meet
    /// on the way, so that a search goes from one to another, the line is halved.
    void find_flutter(const Position &from, const Position &to,
                      const std::vector<std::complex<double>> &a,
                      const std::vector<std::complex<double>> &b, unsigned int halvings);
    /// Appends where the growth rate of a mode vanishes; false if the search ended at another mode.
    bool locate_crossing(const Position &from, const Position &to, std::complex<double> l_before,
                         std::complex<double> l_now, std::vector<BoundaryPoint> &found);
    void add_divergence(unsigned int before, unsigned int now, const EigenPairs &modes);

    void trace_boundaries();
    /// Whether a point lies on a curve that was traced.
    static bool is_on(const std::vector<BoundaryPoint> &curve, const BoundaryPoint &point);
    std::vector<BoundaryPoint> trace(const BoundaryPoint &crossing);
    /// The function of a divergent mode beside a point, or none.
    std::unique_ptr<StaticInstability> instability_beside(const Position &at);
    /// What is across the boundary at a point of it, and the band that the mesh leaves.
    void assess(BoundaryPoint &point, const Evaluation &there);
    /// Assesses a divergence by l^2 of the divergent mode beside, whose effect and derivative are
    /// in the same ratio as there.
    void assess_divergence(BoundaryPoint &point);
    std::optional<CriticalBar> bar_of(const Position &at, const EigenPairs &modes,
                                      unsigned int mode, double slope) const;
    /// One step along the boundary; false at its end.
    bool step(const BoundaryPoint &last, const BoundaryFunction &function, Position &tangent,
              double &length, BoundaryPoint &next, Evaluation &there);
    /// Newton's method along the gradient, or along one axis if the other coordinate is held.
    static bool correct(const BoundaryFunction &function, Position &at, int held,
                        Evaluation &result, BoundaryPoint &point);

    static constexpr double longest_step = 0.5, shortest_step = 0.01; ///< cells

    const std::array<std::vector<double>, 2> values;
    std::optional<InterpolatedEffects> effects; ///< with an estimator
    std::unique_ptr<Table> map_csv, border_csv;

    std::vector<std::vector<std::complex<double>>>
        eigenvalues;                    ///< by point of the grid, walked so far
    std::vector<unsigned int> left_out; ///< points without a load
    std::vector<BoundaryPoint> crossings;
    unsigned int n_curves = 0;
    std::vector<double> varying_terms; ///< of the last expansion point on the grid
    bool is_full = false;              ///< the last point of the grid was solved in full
    bool at_edge = false;              ///< whether the last step of a curve ended at the map's edge
  };
} // namespace squeal
