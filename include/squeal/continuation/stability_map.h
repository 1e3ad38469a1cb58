#pragma once

#include <squeal/assessment/divergence.h>
#include <squeal/assessment/tables.h>
#include <squeal/base/log.h>
#include <squeal/continuation/mode_tracker.h>
#include <squeal/parameters/parameter_file.h>

#include <array>
#include <functional>
#include <memory>

namespace squeal
{
  /// The stability of a model over two parameters: map.csv, a line for each point of the grid, and
  /// border.csv, the curves on which a mode changes between decay and growth.
  ///
  /// The grid is walked to and fro, so that each point starts from the vectors of a neighbour.
  /// Between neighbours the modes are paired by their eigenvalues; where the growth rate of a pair
  /// changes its sign, Re l = 0 is solved on that line of the grid (det Q = 0 where a real
  /// eigenvalue grows). From each such point the curve is continued with steps of at most half a
  /// cell: along its tangent, which the derivatives by both parameters give, and back onto it by
  /// Newton's method along the gradient. The derivatives come from left and right vectors, so the
  /// operators are never differentiated numerically here.
  ///
  /// What is done is on disk after each point of the grid and each curve; a map that was killed
  /// resumes there.
  class StabilityMap
  {
  public:
    StabilityMap(ParameterFile &file, Model &model, const EigensolverOptions &options,
                 const std::string &directory, MPI_Comm comm, Log &log);

    /// Throws InputError, SolverError.
    void run();

  private:
    /// A position in units of the grid's cells, counted from the first values.
    using Position = std::array<double, 2>;

    /// A point of the border.
    struct BorderPoint
    {
      Position at{};
      std::complex<double> lambda;
      double accuracy = 0; ///< last step of Newton's method, cells
      bool divergence = false;
      bool done       = false; ///< on a curve that was traced
    };

    /// The function that vanishes on the border, its gradient by position, and what is needed to go
    /// on from there.
    struct Evaluation
    {
      double value = 0;
      Position gradient{};
      std::complex<double> lambda;
      std::array<std::complex<double>, 2> slope{}; ///< dl by position
    };

    using BorderTest = std::function<Evaluation(const Position &)>;

    double parameter_at(unsigned int k, double position) const;
    double cell_size(unsigned int k, double position) const;
    Position position_of(unsigned int point) const;
    bool inside(const Position &at, double margin) const;
    /// Cuts the way to a position at the edge of the map; the coordinate that is constant on that
    /// edge, or -1.
    int clip(const Position &from, Position &to) const;
    bool is_marginal(const std::complex<double> lambda) const
    {
      return std::abs(lambda.real()) <= 10 * options.tolerance * std::abs(lambda);
    }

    const Parameters::All &parameters_at(const Position &at);
    void anchor(const Position &at);
    Evaluation evaluate(const Position &at, std::complex<double> expected);
    Evaluation evaluate_divergence(const Position &at, const StaticInstability &instability);

    void walk_grid();
    void write(const Position &at, const Modes &modes);
    /// The crossings between two neighbours of the grid, of which the second has just been solved.
    void find_crossings(unsigned int before, unsigned int now, const Modes &modes);
    void add_crossing(unsigned int before, unsigned int now, std::complex<double> l_before,
                      std::complex<double> l_now);
    void add_divergence(unsigned int before, unsigned int now, const Modes &modes);

    void trace_border();
    std::vector<BorderPoint> trace(const BorderPoint &seed);
    bool step(const BorderPoint &last, const Evaluation &here, Position &tangent, double &length,
              BorderPoint &next, Evaluation &there);
    BorderTest test_from(const BorderPoint &last, const Evaluation &here);
    static bool correct(const BorderTest &test, Position &at, int held, Evaluation &result,
                        double &accuracy);

    void save() const;
    bool resume();
    std::string state_file() const
    {
      return directory + "/map.state";
    }

    static constexpr double longest_step = 0.5, shortest_step = 0.01; ///< cells

    ParameterFile &file;
    const std::array<std::string, 2> parameters;
    const std::array<std::vector<double>, 2> values;
    const EigensolverOptions options;
    const std::string directory;
    const MPI_Comm comm;
    Log &log;
    ModeTracker follower;
    std::unique_ptr<Table> map_csv, border_csv;

    std::vector<std::vector<std::complex<double>>>
        eigenvalues; ///< by point of the grid, walked so far
    std::vector<BorderPoint> crossings;
    unsigned int n_curves = 0;
    std::unique_ptr<StaticInstability> instability; ///< of the curve that is being traced
    bool at_edge = false; ///< whether its last step ended at the map's edge
  };
} // namespace squeal
