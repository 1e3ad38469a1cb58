#include "chains.h"

#include <doctest/doctest.h>

#include <squeal/studies/study.h>
namespace squeal::tests::study_tests
{
  namespace
  {
    /// Squares the numbers from 0 on, of which it saves what comes after each even one; one of them
    /// fails.
    class Squares : public Study
    {
    public:
      Squares(ParameterFile &file, Model &model, const std::string &directory, Log &log,
              const unsigned int n_squares, const int fails_at = -1)
          : Study({"squares", "number", "a square", {"squares.csv"}}, file, {first_factor}, model,
                  {}, directory, MPI_COMM_WORLD, log, {}),
            n_squares(n_squares), fails_at(fails_at)
      {
      }
      std::vector<double> squares;
      std::vector<unsigned int> solved; ///< in this run

    private:
      unsigned int n_points() const override
      {
        return n_squares;
      }
      void visit(Archive &state) override
      {
        state(squares);
      }
      std::string take_up() override
      {
        return squares.size() == n_done ? "" : "too many squares.";
      }
      void open(const bool resumed) override
      {
        csv = table("squares.csv", {{"square", 0.}}, resumed);
      }
      void solve(const unsigned int point) override
      {
        if (int(point) == fails_at)
          throw SolverError("fails");
        varied.parameters_at({double(point)});
        solved.push_back(point);
        squares.push_back(point * point);
        csv->add({{"square", squares.back()}});
      }
      bool can_be_saved() const override
      {
        return squares.size() % 2 == 1;
      }
      bool leave_out(unsigned int /*point*/) override
      {
        return false;
      }

      const unsigned int n_squares;
      const int fails_at;
      std::unique_ptr<Table> csv;
    };

    /// What a run of so many squares does in a directory.
    struct Outcome
    {
      std::vector<unsigned int> solved;
      std::string table;
      double parameter;
      bool has_state;
    };
    Outcome run(const TemporaryDirectory &directory, const unsigned int n_squares,
                const int fails_at = -1)
    {
      ParameterFile file;
      file.vary({first_factor}, {7});
      const auto model = TwoChains::model();
      Log log(MPI_COMM_SELF);
      Squares study(file, *model, directory.name, log, n_squares, fails_at);
      try
      {
        study.run();
      }
      catch (const SolverError &)
      {
      }
      MPI_Barrier(MPI_COMM_WORLD);
      const Outcome outcome = {study.solved, directory.text_of("squares.csv"),
                               file.value_of(first_factor),
                               std::filesystem::exists(directory.name + "/squares.state")};
      MPI_Barrier(MPI_COMM_WORLD); // nobody writes the next table while another rank reads this one
      return outcome;
    }
    const std::string all = "square\n0\n1\n4\n9\n16\n";
  } // namespace

  TEST_CASE("study: one run leaves its table, the parameter's value, and no state")
  {
    const TemporaryDirectory directory;
    const Outcome whole = run(directory, 5);
    CHECK(whole.solved == std::vector<unsigned int>{0, 1, 2, 3, 4});
    CHECK(whole.table == all);
    CHECK(whole.parameter == 7);
    CHECK(!whole.has_state);
  }

  TEST_CASE("study: an interrupted run goes on after the last point that was saved")
  {
    const TemporaryDirectory directory;
    const Outcome first = run(directory, 5, 4);
    CHECK(first.has_state);
    CHECK(first.table == "square\n0\n1\n4\n9\n");
    const Outcome second = run(directory, 5);
    CHECK(second.solved == std::vector<unsigned int>{3, 4}); // 9 was in the table, and is again
    CHECK(second.table == all);
    CHECK(second.parameter == 7);
    CHECK(!second.has_state);
  }

  TEST_CASE("study: a state of more points than there are is refused, and nothing of it stays")
  {
    const TemporaryDirectory directory;
    run(directory, 9, 8);
    const Outcome anew = run(directory, 5);
    CHECK(anew.solved == std::vector<unsigned int>{0, 1, 2, 3, 4});
    CHECK(anew.table == all);
  }
} // namespace squeal::tests::study_tests
