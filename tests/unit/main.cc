// Suites say where a test case is left out, by words in their names (tests/CMakeLists.txt and
// tests/run/test_debug_build.py; a case without a suite runs everywhere):
//   slow               in the quick run
//   one rank           on several ranks: what each rank does for itself
//   two ranks at most  on three ranks, slow on two cores: what two ranks show as well
//   optimised          in the Debug build: what takes minutes there, its parts being in other tests

#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <deal.II/base/exceptions.h>
#include <deal.II/base/mpi.h>

#include <petscsys.h>

#include <iostream>
#include <sstream>

namespace
{
  int n_ranks()
  {
    return dealii::Utilities::MPI::n_mpi_processes(MPI_COMM_WORLD);
  }

  /// An exception that leaves a test on one rank only would leave the others waiting in its next
  /// collective call: in parallel it ends all ranks.
  struct EndAllRanksOnException : doctest::IReporter
  {
    explicit EndAllRanksOnException(const doctest::ContextOptions &) {}

    void test_case_start(const doctest::TestCaseData &data) override
    {
      name = data.m_name;
    }
    void test_case_exception(const doctest::TestCaseException &exception) override
    {
      if (n_ranks() == 1)
        return;
      std::cerr << "\nRank " << dealii::Utilities::MPI::this_mpi_process(MPI_COMM_WORLD)
                << ", test '" << name << "' threw: " << exception.error_string << std::endl;
      MPI_Abort(MPI_COMM_WORLD, 1);
    }

    void report_query(const doctest::QueryData &) override {}
    void test_run_start() override {}
    void test_run_end(const doctest::TestRunStats &) override {}
    void test_case_reenter(const doctest::TestCaseData &) override {}
    void test_case_end(const doctest::CurrentTestCaseStats &) override {}
    void subcase_start(const doctest::SubcaseSignature &) override {}
    void subcase_end() override {}
    void log_assert(const doctest::AssertData &) override {}
    void log_message(const doctest::MessageData &) override {}
    void test_case_skipped(const doctest::TestCaseData &) override {}

    std::string name;
  };
  REGISTER_LISTENER("end_all_ranks", 1, EndAllRanksOnException);
} // namespace

int main(int argc, char *argv[])
{
  // PETSc would take doctest's options for its own, so it sees only the program's name.
  int n_visible     = 1;
  char *only_name[] = {argv[0], nullptr};
  char **visible    = only_name;
  dealii::Utilities::MPI::MPI_InitFinalize mpi(n_visible, visible, 1);
  PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);
  dealii::deal_II_exceptions::disable_abort_on_exception();

  // Every rank runs every test; rank 0 speaks, the others only if something failed there.
  doctest::Context context(argc, argv);
  const unsigned int rank = dealii::Utilities::MPI::this_mpi_process(MPI_COMM_WORLD);
  std::ostringstream silent;
  if (rank > 0)
    context.setCout(&silent);
  const int status = context.run();
  if (rank > 0 && status != 0)
    std::cout << "Rank " << rank << ":\n" << silent.str() << std::flush;
  return dealii::Utilities::MPI::max(status, MPI_COMM_WORLD);
}
