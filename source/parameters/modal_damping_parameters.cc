#include <squeal/parameters/declare.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/parameters.h>

#include <algorithm>
#include <iterator>

namespace squeal
{
  namespace Parameters
  {
    void ModalDamping::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Modal damping");
      prm.declare_entry(
          "Ratios", "", Patterns::Map(Patterns::Double(), Patterns::Double(), 0, 1000),
          "Pairs frequency : ratio, Hz and a part of critical damping, -, by ascending "
          "frequencies, as a modal test of the brake gives them: each real mode of the brake "
          "with its contact, without friction, is damped by the ratio of its frequency, linear "
          "between those given and constant beyond. Used in the stage full, beside the damping "
          "of materials. Empty: none.");
      prm.add_action("Ratios",
                     [this](const std::string &text)
                     {
                       ratios.clear();
                       for (const std::vector<std::string> &pair : entries_of(text))
                         ratios.push_back({to_number(pair[0]).value(), to_number(pair[1]).value()});
                     });
      prm.add_parameter("Factor", factor, "A factor of all ratios, -.", not_negative());
    }

    double ModalDamping::at(const double frequency) const
    {
      const auto next =
          std::find_if(ratios.begin(), ratios.end(),
                       [&](const Ratio &ratio) { return ratio.frequency >= frequency; });
      if (next == ratios.begin() || next == ratios.end())
        return factor * (next == ratios.begin() ? ratios.front() : ratios.back()).value;
      const Ratio &before = *std::prev(next);
      const double part   = (frequency - before.frequency) / (next->frequency - before.frequency);
      return factor * (before.value + part * (next->value - before.value));
    }

    double ModalDamping::slope(const double frequency) const
    {
      constexpr double h = 1e-6; // between ratios a parabola, of which this is the slope
      const auto product = [&](const double f) { return f * at(f); };
      return (product(frequency * (1 + h)) - product(frequency * (1 - h))) / (2 * h * frequency);
    }

    void ModalDamping::check() const
    {
      const std::string key = "Modal damping/Ratios";
      double last           = -1;
      for (const Ratio &ratio : ratios)
      {
        if (ratio.frequency < 0 || ratio.frequency <= last)
          fail(key, ratio.frequency, "frequencies must ascend from 0 Hz or more.");
        if (ratio.value < 0 || ratio.value * factor >= 1)
          fail(key, ratio.value,
               "allowed are ratios of critical damping from 0 to below 1, -, also times Modal "
               "damping/Factor.");
        last = ratio.frequency;
      }
    }
  } // namespace Parameters
} // namespace squeal
