#include <squeal/run/refinement.h>

#include <doctest/doctest.h>
namespace squeal::tests::refinement_tests
{
  namespace
  {
    bool objects(const RefinementBudget &budget, const double n_unknowns, const std::string &key)
    {
      const std::string text = budget.objection(n_unknowns);
      CHECK((text.empty() || text.find("Refinement/" + key + " = ") != std::string::npos));
      return !text.empty();
    }
  } // namespace

  TEST_CASE("refinement budget: without limits only unknowns count")
  {
    Parameters::Refinement limits;
    limits.maximum_unknowns = 1000;
    RefinementBudget budget(limits);
    budget.add_mesh({100, 1e6, 1e6});
    CHECK(!objects(budget, 1000, "Maximum unknowns"));
    CHECK(objects(budget, 1001, "Maximum unknowns"));
  }

  TEST_CASE("refinement budget: time, by the powers 3/2 and that of the last two meshes")
  {
    Parameters::Refinement limits;
    limits.maximum_time = 10;
    RefinementBudget budget(limits);
    // One second; four times the unknowns take 8 more: 9 in all. 4.4 times: 1 + 9.2.
    budget.add_mesh({1000, 1, 1});
    CHECK(!objects(budget, 4000, "Maximum time"));
    CHECK(objects(budget, 4400, "Maximum time"));
    // Twice the unknowns took twice the time: 3 s so far, and the next one takes 1 s per 1000.
    budget.add_mesh({2000, 2, 1});
    CHECK(!objects(budget, 6900, "Maximum time"));
    CHECK(objects(budget, 7100, "Maximum time"));
  }

  TEST_CASE(
      "refinement budget: memory is a peak, by the powers 4/3 and that of the last two meshes")
  {
    Parameters::Refinement limits;
    limits.maximum_memory = 16;
    RefinementBudget budget(limits);
    budget.add_mesh({1000, 1, 1});
    CHECK(!objects(budget, 7900, "Maximum memory"));
    CHECK(objects(budget, 8100, "Maximum memory"));
    // The power measured, 3/2; a peak that has not moved counts as the power one.
    budget.add_mesh({4000, 1, 8});
    CHECK(!objects(budget, 6300, "Maximum memory"));
    CHECK(objects(budget, 6400, "Maximum memory"));
    budget.add_mesh({5000, 1, 8});
    CHECK(!objects(budget, 9900, "Maximum memory"));
    CHECK(objects(budget, 10100, "Maximum memory"));
  }
} // namespace squeal::tests::refinement_tests
