#pragma once

#include <squeal/branches.h>
#include <squeal/log.h>
#include <squeal/output.h>
#include <squeal/parameter_file.h>

#include <memory>

namespace squeal
{
  /// Follows the modes of a model along one parameter and, if asked for, locates critical values.
  ///
  /// Each point starts from the vectors of the one before. Where branches cannot be told apart the
  /// step is halved, up to max_halvings times. What is done is on disk after each point: a sweep
  /// that was killed resumes there, bit by bit.
  class Sweep
  {
  public:
    static constexpr unsigned int max_halvings = 5;

    Sweep(ParameterFile &file, Model &model, const EigensolverOptions &options,
          const std::string &directory, MPI_Comm comm, Log &log);

    /// Throws InputError, SolverError.
    void run();

  private:
    /// A value at which something happens, on one branch or between two.
    struct Critical
    {
      std::string kind; ///< onset, end, coalescence
      double value = 0, accuracy = 0;
      std::complex<double> lambda;
      int branch = -1, other = -1;
      unsigned int iterations = 0;
    };

    void solve(double value, const BranchPoint *before, BranchPoint &point);
    /// From a point to a value: branches continued, critical values in between located.
    BranchPoint advance(const BranchPoint &from, double value, unsigned int n_halvings);
    void write(const BranchPoint &point);
    bool resume(BranchPoint &last, unsigned int &n_done);
    void save(const BranchPoint &point) const;

    void find_critical_values(const BranchPoint &from, const BranchPoint &to);
    /// Re l = 0 on a branch by Newton's method, kept inside of the interval.
    Critical onset(const BranchPoint &from, const BranchPoint &to, unsigned int branch);
    /// ((l_i - l_j)/2)^2 = 0 by Newton's method: this is smooth where the eigenvalues themselves
    /// are not.
    Critical coalescence(const BranchPoint &from, const BranchPoint &to, unsigned int branch,
                         unsigned int other);
    /// The eigenvalues nearest to the given ones at a value, and their derivatives.
    struct Evaluation
    {
      std::vector<std::complex<double>> lambda, derivative;
    };
    Evaluation evaluate(double value, const BranchPoint &near,
                        const std::vector<std::complex<double>> &expected);
    void report(const Critical &critical);

    std::string state_file() const;

    ParameterFile &file;
    Model &model;
    const std::string parameter;
    const EigensolverOptions options;
    const std::string directory;
    const MPI_Comm comm;
    Log &log;
    const std::unique_ptr<Eigensolver> solver;
    std::unique_ptr<Table> sweep_csv, critical_csv;
    QuadraticEigenproblem problem; ///< of the last solution
  };
} // namespace squeal
