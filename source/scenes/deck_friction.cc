#include <squeal/scenes/deck_sections.h>

namespace squeal
{
  using namespace deck_text;

  namespace
  {
    /// The function that is linear between points (x, y) and constant outside, by absolute
    /// values, which need no commas: c + sum of half the changes of slope times |x - x_i|.
    std::string piecewise_linear(const std::string &variable, const std::vector<double> &x,
                                 const std::vector<double> &y)
    {
      std::string sum;
      double constant = y[0], slope = 0;
      for (std::size_t i = 0; i < x.size(); ++i)
      {
        const double next = i + 1 < x.size() ? (y[i + 1] - y[i]) / (x[i + 1] - x[i]) : 0,
                     half = (next - slope) / 2;
        slope             = next;
        constant -= half * (x[i] - x[0]);
        if (half != 0)
          sum += "+(" + digits(half) + ")*abs(" + variable + "-" + digits(x[i]) + ")";
      }
      return "(" + digits(constant) + sum + ")";
    }

    /// A table by slip rate and pressure, linear between its values: sum over the pressures p_j
    /// of mu_j(v) times the function of p that is 1 at p_j and 0 at the others.
    std::string table_of_friction(const DeckAssembly &all,
                                  const std::vector<std::array<double, 3>> &table)
    {
      std::map<double, std::map<double, double>> by_pressure;
      for (const auto &[mu, v, p] : table)
        by_pressure[p / (all.length * all.length)][v * all.length] = mu;
      std::vector<double> pressures;
      for (const auto &entry : by_pressure)
        pressures.push_back(entry.first);
      std::string sum;
      for (std::size_t j = 0; j < pressures.size(); ++j)
      {
        std::vector<double> speeds, values, unit(pressures.size());
        for (const auto &[v, mu] : by_pressure.at(pressures[j]))
        {
          speeds.push_back(v);
          values.push_back(mu);
        }
        unit[j] = 1;
        sum += (sum.empty() ? "" : "+") + piecewise_linear("v", speeds, values);
        if (pressures.size() > 1)
          sum += "*" + piecewise_linear("p", pressures, unit);
      }
      return sum;
    }

    /// Keys and values of a pair's friction law.
    std::vector<std::pair<std::string, std::string>> friction_law(const DeckAssembly &all,
                                                                  const DeckContact &pair)
    {
      const DeckInteraction &of = all.interaction_of(pair);
      if (of.table.size() > 1)
        return {{"Law", "expression"}, {"Expression", table_of_friction(all, of.table)}};
      if (of.decays && of.decay > 0)
        return {{"Law", "falling"},
                {"Coefficient", digits(all.friction_of(pair))},
                {"Coefficient at speed", digits(of.at_speed)},
                {"Decay speed", digits(all.length / of.decay)}};
      return {{"Law", "constant"}, {"Coefficient", digits(all.friction_of(pair))}};
    }

    /// Notes what of one contact cannot be read.
    void look_at(DeckAssembly &all, const DeckContact &contact, const bool slides)
    {
      const auto found          = all.deck.interactions.find(contact.interaction);
      const std::string between = " between " + contact.first + " and " + contact.second;
      const auto leave_out      = [&](const std::string &what)
      { all.leave_out(DeckMeaning::rubs, what + between); };
      if (found == all.deck.interactions.end())
        return leave_out("there is no *SURFACE INTERACTION '" + contact.interaction + "'");
      const DeckInteraction &of = found->second;
      for (const std::string &problem : of.problems)
        leave_out(problem);
      if (slides && of.is_rough)
        leave_out("*FRICTION, ROUGH of surfaces that slide,");
      if (slides && of.stiffness != all.interaction_of(all.pairs[0]).stiffness)
        leave_out("*SURFACE BEHAVIOR: the stiffness " + digits(of.stiffness) +
                  ", where the first pair has " +
                  digits(all.interaction_of(all.pairs[0]).stiffness) +
                  " (0: hard), and the brake can have one: give all pairs the same one,");
      if (!slides && of.stiffness > 0)
        leave_out("*SURFACE BEHAVIOR: the stiffness " + digits(of.stiffness) +
                  " of surfaces that do not slide, which are hard here: say HARD,");
      if (!slides && (of.table.size() > 1 || of.decays))
        leave_out("*FRICTION that varies, of surfaces that do not slide: give one coefficient,");
    }
  } // namespace

  void check_interactions(DeckAssembly &all)
  {
    for (const DeckContact &contact : all.pairs)
      look_at(all, contact, true);
    for (const DeckContact &contact : all.joints)
      look_at(all, contact, false);
  }

  std::string deck_friction(const DeckAssembly &all)
  {
    if (all.pairs.empty())
      return "";
    const auto law = friction_law(all, all.pairs[0]);
    std::string of_pads;
    for (const DeckContact &pair : all.pairs)
      if (const auto other = friction_law(all, pair); other != law)
      {
        append(of_pads, pair.first + " :");
        for (std::size_t k = 0; k < other.size(); ++k)
          of_pads += (k > 0 ? "; " : " ") + other[k].first + " " + other[k].second;
      }
    std::string text = "\nsubsection Contact\n";
    if (const double stiffness = all.interaction_of(all.pairs[0]).stiffness; stiffness > 0)
      text += "  set Formulation = penalty\n  set Penalty stiffness = " +
              digits(stiffness / (all.length * all.length * all.length)) + "\n";
    text += "  subsection Friction\n";
    for (const auto &[key, value] : law)
      if (key != "Law" || value != "constant")
        text += "    set " + key + " = " + value + "\n";
    if (!of_pads.empty())
      text += "    set Of pads = " + of_pads + "\n";
    return text + "  end\nend\n";
  }
} // namespace squeal
