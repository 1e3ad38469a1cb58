#include <squeal/scenes/deck_sections.h>

#include <array>
#include <cmath>

namespace squeal
{
  using namespace dealii;
  using namespace deck_text;

  namespace
  {
    /// E_t, nu_t, E_n, nu_tn, G_tn of engineering constants E1 E2 E3 nu12 nu13 nu23 G12 G13 G23
    /// of which one direction n is along the rotor's axis and the two others, t, are alike:
    /// nu_tn = nu_nt E_t / E_n, G_t = E_t / 2 (1 + nu_t).
    std::array<double, 5> transversely_isotropic(const DeckAssembly &all, const DeckLaw &law,
                                                 const std::vector<double> &constants)
    {
      std::array<Tensor<1, 3>, 3> directions;
      for (unsigned int d = 0; d < 3; ++d)
        directions[d][d] = 1;
      if (!law.orientation.empty())
      {
        const auto found = all.deck.orientations.find(law.orientation);
        if (found == all.deck.orientations.end())
          all.fail("there is no rectangular *ORIENTATION " + law.orientation + ".");
        directions[0] = found->second.first;
        directions[2] = cross_product_3d(found->second.first, found->second.in_plane);
        directions[1] = cross_product_3d(directions[2], directions[0]);
      }
      const std::array<double, 3> E = {{constants[0], constants[1], constants[2]}};
      // By the direction that a pair of directions leaves out
      const std::array<double, 3> nu = {{constants[5], constants[4], constants[3]}},
                                  G  = {{constants[8], constants[7], constants[6]}};
      const auto equal               = [](const double a, const double b)
      { return std::abs(a - b) <= 1e-6 * (std::abs(a) + std::abs(b)); };
      for (unsigned int n = 0; n < 3; ++n)
      {
        if (!(std::abs(directions[n][all.axis]) > (1 - 1e-6) * directions[n].norm()))
          continue;
        const unsigned int s = n == 0 ? 1 : 0, t = n == 2 ? 1 : 2;
        // nu_ij, i < j, is the contraction along j by stretch along i.
        const auto of_stretch_across = [&](const unsigned int across)
        {
          const double value = nu[3 - n - across];
          return across < n ? value : value * E[across] / E[n];
        };
        if (!equal(E[s], E[t]) || !equal(G[s], G[t]) ||
            !equal(of_stretch_across(s), of_stretch_across(t)) ||
            !equal(G[n], E[s] / (2 * (1 + nu[n]))))
          break;
        return {{E[s], nu[n], E[n], of_stretch_across(s), G[s]}};
      }
      all.fail("the engineering constants of " + law.material +
               " are not transversely isotropic about the rotor's axis, the only anisotropic law "
               "that squeal has: two directions across the axis must be alike, G = E / 2 (1 + nu) "
               "between them.");
    }
  } // namespace

  std::string deck_material(const DeckAssembly &all, const DeckLaw &law, const std::string &indent)
  {
    const DeckMaterial &material = all.deck.materials.at(law.material);
    // N/mm^2 and t/mm^3: a stress is force over area, a density mass over volume.
    const double stress  = 1 / (all.length * all.length),
                 density = (all.length == 1 ? 1 : 1e3) / (all.length * all.length * all.length) *
                           material.density;
    std::string text = indent + "# " + law.material + "\n";
    const auto add   = [&](const std::string &key, const double value)
    { text += indent + "set " + key + " = " + digits(value) + "\n"; };
    if (material.elastic.size() == 2)
    {
      add("Young modulus", stress * material.elastic[0]);
      add("Poisson ratio", material.elastic[1]);
    }
    else
    {
      const std::array<double, 5> constants = transversely_isotropic(all, law, material.elastic);
      text += indent + "set Law = transversely_isotropic\n";
      add("Young modulus", stress * constants[0]);
      add("Poisson ratio", constants[1]);
      add("Axial Young modulus", stress * constants[2]);
      add("Axial Poisson ratio", constants[3]);
      add("Axial shear modulus", stress * constants[4]);
    }
    add("Density", density);
    add("Mass proportional damping", material.mass_damping);
    add("Stiffness proportional damping", material.stiffness_damping);
    if (material.loss_factor != 0)
      add("Loss factor", material.loss_factor);
    return text;
  }
} // namespace squeal
