#include <squeal/assessment/tables.h>
#include <squeal/run/refinement.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  std::vector<double> refinement_indicators(const std::vector<ModeRow> &rows,
                                            const EigenvalueErrors &errors, const double tolerance)
  {
    std::vector<double> weights;
    bool is_open = false;
    for (unsigned int j = 0; j < rows.size(); ++j)
    {
      const double size = std::abs(rows[j].lambda), allowed = tolerance * size;
      double weight = 0;
      if (tolerance > 0)
        weight = std::hypot(errors.bounds.growth_rate[j], errors.bounds.imaginary[j]) > allowed
                     ? 1 / allowed
                     : 0;
      else if (rows[j].verdict == Verdict::undecided)
        weight = 1 / std::max(std::abs(rows[j].lambda.real()), 1e-6 * size);
      weights.push_back(weight);
      is_open |= weight > 0;
    }
    std::vector<double> result;
    for (const auto &parts : errors.cells)
    {
      double sum = 0;
      for (unsigned int j = 0; j < rows.size(); ++j)
        sum += weights[j] * std::abs(parts[j]);
      if (is_open)
        result.push_back(sum);
    }
    return result;
  }

  double RefinementBudget::predict(double Mesh::*value, const double n_unknowns,
                                   const double first_exponent) const
  {
    const Mesh &last = meshes.back();
    double exponent  = first_exponent;
    if (meshes.size() > 1)
    {
      const Mesh &before = meshes[meshes.size() - 2];
      if (last.n_unknowns > before.n_unknowns && before.*value > 0)
        exponent =
            std::log(last.*value / before.*value) / std::log(last.n_unknowns / before.n_unknowns);
    }
    return last.*value * std::pow(n_unknowns / last.n_unknowns, std::clamp(exponent, 1., 2.));
  }

  std::string RefinementBudget::objection(const double n_unknowns) const
  {
    const std::string start =
        "No further mesh: it would have about " + number(std::round(n_unknowns)) + " unknowns";
    if (n_unknowns > limits.maximum_unknowns)
      return start + ", more than Refinement/Maximum unknowns = " +
             std::to_string(limits.maximum_unknowns) + ".";
    if (meshes.empty())
      return "";
    if (limits.maximum_time > 0)
    {
      double so_far = 0;
      for (const Mesh &mesh : meshes)
        so_far += mesh.seconds;
      const double time = so_far + predict(&Mesh::seconds, n_unknowns, 1.5);
      if (time > limits.maximum_time)
        return start + " and end about " + number(time, 3) +
               " s after the start of the run, later than Refinement/Maximum time = " +
               number(limits.maximum_time) + " s.";
    }
    const double memory = predict(&Mesh::memory, n_unknowns, 4. / 3);
    if (limits.maximum_memory > 0 && memory > limits.maximum_memory)
      return start + " and need about " + number(memory, 3) +
             " GiB, more than Refinement/Maximum memory = " + number(limits.maximum_memory) +
             " GiB.";
    return "";
  }
} // namespace squeal
