#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/deck_keywords.h>
#include <squeal/mesh_files/deck_lines.h>
#include <squeal/mesh_files/deck_model.h>

#include <algorithm>
#include <cmath>
#include <optional>

// What a deck says beside its mesh: DeckModelReader goes over the blocks of a deck once. Each
// keyword comes with all of its data lines (large ones of the mesh are skipped, another reader has
// them); take() hands them to the function of that keyword, which fills the DeckModel: materials,
// sections, orientations, surfaces, contact, supports, loads, lumped elements. The last step
// counts. What is not read and carries something by deck_keywords.h, or is unknown, is in
// DeckModel::not_read; what carries nothing is passed over, so that no part of a deck is dropped
// unseen.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Keywords with their data, parts and instances included.
    class DeckModelReader
    {
    public:
      DeckModelReader(std::istream &in, const std::string &filename) : lines(in, filename) {}

      DeckModel read()
      {
        while (lines.next_keyword(keyword))
        {
          where = text_of(lines.current().file, ", line ", lines.line_number());
          blocks_of_supports.see(keyword.name);
          data.clear();
          const bool is_mesh = keyword.name == "*ELEMENT" &&
                               keyword.value("TYPE").rfind("C3D", 0) == 0; // large, and known
          if (!is_mesh && !(keyword.name == "*NODE" && !scope.empty()))
            for (std::vector<std::string> fields; lines.next_data(fields);)
              data.push_back(fields);
          take();
        }
        finish();
        return std::move(model);
      }

    private:
      void pass_over(const std::string &why = "")
      {
        model.passed_over.push_back(where + ": " + keyword.name + (why.empty() ? "" : ", ") + why);
      }

      void not_read(const DeckMeaning meaning, const std::string &why = "")
      {
        model.not_read.emplace_back(meaning,
                                    where + ": " + keyword.name + (why.empty() ? "" : ", ") + why);
      }

      /// Throws InputError with the place of the keyword.
      [[noreturn]] void fail(const std::string &message) const
      {
        throw InputError("--from-deck: " + where + ": " + keyword.name + message);
      }

      double number(const std::size_t row, const std::size_t column) const
      {
        if (row >= data.size() || column >= data[row].size())
          fail(" has too few data.");
        return lines.real(data[row][column]);
      }

      std::string option(const std::string &name) const
      {
        if (keyword.value(name).empty())
          fail(" needs " + name + "=.");
        return keyword.value(name);
      }

      void take()
      {
        const std::string &name = keyword.name;
        if (take_structure() || take_contact() || take_step())
          return;
        if (name == "*NODE" || name == "*NSET" || name == "*ELEMENT")
          take_mesh();
        else if (name == "*MATERIAL")
          material = &model.materials[option("NAME")];
        else if (name == "*ELASTIC" || name == "*DENSITY" || name == "*DAMPING")
          take_material();
        else if (material && (name == "*HYPERELASTIC" || name == "*HYPERFOAM" ||
                              name == "*VISCOELASTIC" || name == "*USER MATERIAL"))
          material->unread.push_back(where + ": " + name);
        else if (name == "*EXPANSION")
          expands = true;
        else if (name == "*ORIENTATION")
          take_orientation();
        else if (name == "*TRANSFORM")
          take_transform();
        else if (name == "*BOUNDARY")
          take_supports();
        else if (name == "*SPRING" || name == "*DASHPOT" || name == "*MASS")
          take_lumped();
        else if (const DeckMeaning meaning = deck_meaning(name); counts(meaning))
          not_read(meaning);
        else if (meaning != DeckMeaning::silent)
          pass_over();
      }

      /// Parts, instances and sections. Returns whether the keyword is one of them.
      bool take_structure()
      {
        const std::string &name = keyword.name;
        if (name == "*PART")
          scope = "part " + option("NAME");
        else if (name == "*END PART")
          scope.clear();
        else if (name == "*INSTANCE")
          take_instance();
        else if (name == "*SOLID SECTION")
        {
          (scope.empty() ? model.sections : sections_of_part[scope])
              .push_back({option("ELSET"), option("MATERIAL"), keyword.value("ORIENTATION")});
        }
        else
          return false;
        return true;
      }

      /// Sections of the instance's part. Orientations turn with the instance.
      void take_instance()
      {
        const std::string part = "part " + option("PART"), instance = option("NAME");
        for (DeckSection section : sections_of_part[part])
        {
          section.volume   = instance + "." + section.volume;
          const auto found = model.orientations.find(part + "." + section.orientation);
          if (!section.orientation.empty() && found != model.orientations.end())
          {
            DeckOrientation orientation = found->second;
            section.orientation         = instance + "." + section.orientation;
            if (data.size() > 1 && data[1].size() > 6)
            {
              Tensor<1, 3> along;
              for (unsigned int d = 0; d < 3; ++d)
                along[d] = number(1, 3 + d) - number(1, d);
              const double angle = number(1, 6) * std::acos(-1.) / 180;
              for (Tensor<1, 3> *direction : {&orientation.first, &orientation.in_plane})
                *direction = turned(*direction, along, angle);
            }
            model.orientations[section.orientation] = orientation;
          }
          model.sections.push_back(section);
        }
      }

      /// Turns a vector about an axis by an angle (Rodrigues).
      static Tensor<1, 3> turned(const Tensor<1, 3> &x, Tensor<1, 3> along, const double angle)
      {
        along /= along.norm();
        return std::cos(angle) * x + std::sin(angle) * cross_product_3d(along, x) +
               (1 - std::cos(angle)) * (along * x) * along;
      }

      /// Ties, couplings, contact and friction. Returns whether the keyword is one of them.
      bool take_contact()
      {
        const std::string &name = keyword.name;
        if (name == "*TIE" || (name == "*CONTACT PAIR" && keyword.has("TIED")))
          take_ties();
        else if (name == "*CONTACT PAIR")
          each_pair(
              [&](const std::string &first, const std::string &second, const auto &) {
                model.contacts.push_back({first, second, keyword.value("INTERACTION")});
              });
        else if (name == "*CONTACT")
          general_contact = where;
        else if (name == "*CONTACT INCLUSIONS")
        {
          if (keyword.has("ALL EXTERIOR"))
            not_read(DeckMeaning::rubs, "ALL EXTERIOR: name the pairs, surface by surface");
          each_pair(
              [&](const std::string &first, const std::string &second, const auto &)
              {
                if (first.empty() || second.empty())
                  not_read(DeckMeaning::rubs, "a surface with itself or with all");
                else
                  included.push_back({first, second, ""});
              });
        }
        else if (name == "*CONTACT PROPERTY ASSIGNMENT")
          each_pair(
              [&](const std::string &first, const std::string &second, const auto &fields)
              {
                if (fields.size() > 2)
                  assigned.push_back({first, second, deck_label(fields[2])});
              });
        else if (name == "*SURFACE INTERACTION")
        {
          interaction = option("NAME");
          model.interactions[interaction];
        }
        else if (name == "*CHANGE FRICTION")
          interaction = option("INTERACTION");
        else if (name == "*FRICTION")
          take_friction();
        else if (name == "*SURFACE BEHAVIOR")
          take_surface_behavior();
        else if (name == "*COUPLING")
          model.surface_of_node[keyword.value("REF NODE")] = option("SURFACE");
        else if (name == "*KINEMATIC")
          not_read(DeckMeaning::joins, "a rigid coupling; left out, it is taken as *DISTRIBUTING, "
                                       "the mean motion of the surface");
        else
          return false;
        return true;
      }

      /// Calls add(first, second, fields) for each data line with two labels.
      template <typename Function>
      void each_pair(const Function &add) const
      {
        for (const std::vector<std::string> &fields : data)
          if (fields.size() > 1)
            add(deck_label(fields[0]), deck_label(fields[1]), fields);
      }

      /// The smallest tolerance of all: what it leaves free in one tie is joined in none.
      void take_ties()
      {
        each_pair([&](const std::string &first, const std::string &second, const auto &)
                  { model.ties.emplace_back(first, second); });
        const std::string text = keyword.value("POSITION TOLERANCE");
        const double tolerance = text.empty() ? 0 : lines.real(text);
        if (tolerance > 0 &&
            (model.position_tolerance == 0 || tolerance < model.position_tolerance))
          model.position_tolerance = tolerance;
      }

      /// The last one of an interaction counts: steps change it.
      void take_friction()
      {
        DeckInteraction &of = model.interactions[interaction];
        of.table.clear();
        of.problems.erase(std::remove_if(of.problems.begin(), of.problems.end(),
                                         [](const std::string &text)
                                         { return text.find("*FRICTION") != std::string::npos; }),
                          of.problems.end());
        const auto problem = [&](const std::string &why)
        { of.problems.push_back(where + ": *FRICTION, " + why); };
        for (const std::string option :
             {"USER", "ANISOTROPIC", "TAUMAX", "TEST DATA", "DEPENDENCIES"})
          if (keyword.has(option))
            problem(option);
        of.is_rough = keyword.has("ROUGH");
        of.decays   = keyword.has("EXPONENTIAL DECAY");
        for (std::size_t row = 0; row < data.size(); ++row)
        {
          of.table.push_back(
              {{number_or_zero(row, 0), number_or_zero(row, 1), number_or_zero(row, 2)}});
          if (row > 0 && number_or_zero(row, 3) != number_or_zero(0, 3))
            problem("by temperature");
        }
        if (of.decays && !of.table.empty())
        {
          of.at_speed = of.table[0][1];
          of.decay    = of.table[0][2];
          of.table.resize(1);
        }
      }

      double number_or_zero(const std::size_t row, const std::size_t column) const
      {
        return row < data.size() && column < data[row].size() && !data[row][column].empty()
                   ? number(row, column)
                   : 0;
      }

      void take_surface_behavior()
      {
        DeckInteraction &of    = model.interactions[interaction];
        const std::string kind = keyword.value("PRESSURE-OVERCLOSURE");
        of.stiffness           = 0;
        if (kind == "LINEAR" || (kind.empty() && keyword.has("PENALTY")))
          of.stiffness = number_or_zero(0, 0);
        else if (!kind.empty() && kind != "HARD")
          of.problems.push_back(where + ": *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=" + kind +
                                "; read are HARD and LINEAR");
        if (keyword.has("NO SEPARATION"))
          of.problems.push_back(where + ": *SURFACE BEHAVIOR, NO SEPARATION");
      }

      /// Steps with their loads and windows. Returns whether the keyword is one of them.
      bool take_step()
      {
        const std::string &name = keyword.name;
        if (name == "*STEP")
        {
          is_perturbation = keyword.has("PERTURBATION");
          cleared.clear();
          period = 1;
        }
        else if (name == "*STATIC")
        {
          period = number_or_zero(0, 1) > 0 ? number_or_zero(0, 1) : 1;
          pass_over();
        }
        else if (name == "*FREQUENCY" || name == "*COMPLEX FREQUENCY")
        {
          is_perturbation = true;
          take_window();
        }
        else if (name == "*STEADY STATE DYNAMICS" || name == "*MODAL DYNAMIC" || name == "*BUCKLE")
        {
          is_perturbation = true;
          pass_over();
        }
        else if (name == "*AMPLITUDE")
          take_amplitude();
        else if (name == "*DSLOAD" || name == "*DLOAD" || name == "*CLOAD")
          take_loads();
        else if (name == "*MOTION")
          take_motion();
        else if (name == "*TEMPERATURE")
          heated =
              where + ": " + name + ", which strains by *EXPANSION; without that it does nothing";
        else if (name == "*INITIAL CONDITIONS" &&
                 (keyword.value("TYPE") == "TEMPERATURE" || keyword.value("TYPE") == "FIELD"))
          pass_over();
        else
          return false;
        return true;
      }

      void take_window()
      {
        if (data.empty())
          return;
        model.n_modes = number_or_zero(0, 0);
        if (number_or_zero(0, 2) > 0)
        {
          model.frequency        = number_or_zero(0, 2);
          model.lowest_frequency = number_or_zero(0, 1);
        }
      }

      /// Pairs of time and factor.
      void take_amplitude()
      {
        std::vector<double> &table = amplitudes[option("NAME")];
        for (std::size_t row = 0; row < data.size(); ++row)
          for (std::size_t k = 0; k < data[row].size(); ++k)
            if (!data[row][k].empty())
              table.push_back(number(row, k));
        const std::string kind = keyword.value("DEFINITION");
        if ((!kind.empty() && kind != "TABULAR" && kind != "SMOOTH STEP") ||
            keyword.value("VALUE") == "ABSOLUTE" || keyword.value("TIME") == "TOTAL TIME" ||
            table.size() % 2 != 0)
          table.clear(); // one that is not followed
      }

      /// The factor at the end of the step, or nothing where it is not known.
      std::optional<double> amplitude_at_end() const
      {
        const auto found = amplitudes.find(keyword.value("AMPLITUDE"));
        if (keyword.value("AMPLITUDE").empty())
          return 1;
        if (found == amplitudes.end() || found->second.empty())
          return {};
        const std::vector<double> &t = found->second;
        if (period >= t[t.size() - 2])
          return t.back();
        for (std::size_t k = 0; k + 3 < t.size(); k += 2)
          if (period <= t[k + 2])
            return period <= t[k]
                       ? t[k + 1]
                       : t[k + 1] + (t[k + 3] - t[k + 1]) * (period - t[k]) / (t[k + 2] - t[k]);
        return {};
      }

      /// Whether OP=NEW takes away what was said before this step; once in a step.
      bool replaces_all()
      {
        return keyword.value("OP") == "NEW" && cleared.insert(keyword.name).second;
      }

      /// The last step's loads count. A load that is said again has its new value.
      void take_loads()
      {
        if (is_perturbation)
          return pass_over("a load of a perturbation, which the static state does not have");
        if (replaces_all())
          for (auto load = loads.begin(); load != loads.end();)
            load = load->first[0] == keyword.name ? loads.erase(load) : std::next(load);
        const std::optional<double> factor = amplitude_at_end();
        for (std::size_t row = 0; row < data.size(); ++row)
        {
          if (data[row].size() < 2)
            continue;
          const std::string on = deck_label(data[row][0]), type = deck_label(data[row][1]),
                            side = keyword.name == "*DLOAD" ? deck_side_of_load(type) : "";
          const bool is_pressure = !side.empty() || (keyword.name == "*DSLOAD" && type == "P"),
                     is_force    = keyword.name == "*CLOAD" && is_component(type);
          const bool is_known    = (is_pressure || is_force) && factor && data[row].size() > 2;
          Load load;
          load.value = is_known ? *factor * number(row, 2) : 0;
          load.where = where;
          if (is_force)
            load.component = type[0] - '1';
          else
            load.surface = side.empty() ? on : deck_load_surface(on, side);
          if (!is_known && (keyword.name != "*CLOAD" || number_or_zero(row, 2) != 0))
            load.problem =
                where + ": " + keyword.name + ", " + on + ", " + type +
                (is_pressure || is_force
                     ? ": the amplitude " + keyword.value("AMPLITUDE") + " is not followed"
                     : ": read are pressures P of *DSLOAD, P1 to P6 of *DLOAD, forces 1 to 3 of "
                       "*CLOAD");
          loads[{{keyword.name, on, type}}] = load;
        }
      }

      /// Whether a label is a component of displacement.
      static bool is_component(const std::string &label)
      {
        return label.size() == 1 && label[0] >= '1' && label[0] <= '3';
      }

      void take_motion()
      {
        if (is_perturbation)
          return pass_over("of a perturbation");
        if (!keyword.has("ROTATION"))
          return not_read(DeckMeaning::turns, "which is no ROTATION");
        const std::optional<double> factor = amplitude_at_end();
        if (!factor)
          return not_read(DeckMeaning::turns, "its amplitude is not followed");
        for (std::size_t row = 0; row < data.size(); ++row)
        {
          std::vector<double> &motion = motions[deck_label(data[row][0])];
          motion                      = {*factor * number(row, 1)};
          for (std::size_t k = 2; k < std::min<std::size_t>(8, data[row].size()); ++k)
            motion.push_back(number(row, k));
        }
      }

      /// What the last step says, when all steps are read.
      void finish()
      {
        for (const auto &[key, load] : loads)
          if (!load.problem.empty())
            model.not_read.emplace_back(DeckMeaning::load, load.problem);
          else if (load.value != 0 && load.component)
            model.forces.push_back({key[1], *load.component, load.value, load.where});
          else if (load.value != 0)
            model.pressures.push_back({load.surface, load.value, load.where});
        if (expands && !heated.empty())
          model.not_read.emplace_back(DeckMeaning::load, heated);
        for (const auto &[set, motion] : motions)
        {
          if (model.speed_is_told && motion[0] != 0 && model.speed != 0 && motion[0] != model.speed)
            model.not_read.emplace_back(DeckMeaning::turns,
                                        "*MOTION of " + set + ": sets turn at different speeds");
          if (!model.speed_is_told || motion[0] != 0)
          {
            model.speed = motion[0];
            model.axis.assign(motion.begin() + 1, motion.end());
          }
          model.speed_is_told = true;
        }
        if (!general_contact.empty() && included.empty())
          model.not_read.emplace_back(DeckMeaning::rubs,
                                      general_contact + ": *CONTACT, without pairs of surfaces");
        for (DeckContact &contact : included)
        {
          for (const DeckContact &of : assigned)
            if (of.first.empty() || (of.first == contact.first && of.second == contact.second) ||
                (of.second == contact.first && of.first == contact.second))
              contact.interaction = of.interaction;
          model.contacts.push_back(contact);
        }
      }

      /// Nodes, sets of one node and elements that are no solids, outside of parts.
      void take_mesh()
      {
        if (!scope.empty())
          return;
        if (keyword.name == "*NODE")
        {
          for (std::size_t row = 0; row < data.size(); ++row)
            if (data[row].size() > 3)
            {
              const std::string node = deck_label(data[row][0]);
              model.nodes[node]      = Point<3>(number(row, 1), number(row, 2), number(row, 3));
              if (keyword.has("NSET"))
                model.node_of_set[keyword.value("NSET")] = node;
            }
        }
        else if (keyword.name == "*NSET")
        {
          if (data.size() == 1 && !data[0].empty() && (data[0].size() == 1 || data[0][1].empty()) &&
              !keyword.has("INSTANCE"))
            model.node_of_set[option("NSET")] = deck_label(data[0][0]);
        }
        else
          for (const std::vector<std::string> &fields : data)
          {
            DeckLumpedElement element{keyword.value("TYPE"), {}};
            for (std::size_t k = 1; k < fields.size(); ++k)
              element.nodes.push_back(deck_label(fields[k]));
            if (!keyword.value("ELSET").empty())
              model.lumped_elements[keyword.value("ELSET")].push_back(element);
          }
      }

      void take_lumped()
      {
        DeckLumped lumped{keyword.name, option("ELSET"), {}, where};
        for (std::size_t row = 0; row < data.size(); ++row)
        {
          lumped.rows.emplace_back();
          for (std::size_t k = 0; k < data[row].size(); ++k)
            if (!data[row][k].empty())
              lumped.rows.back().push_back(number(row, k));
        }
        model.lumped.push_back(lumped);
      }

      void take_material()
      {
        if (!material)
          fail(" stands behind no *MATERIAL.");
        if (keyword.name == "*DENSITY")
          material->density = number(0, 0);
        else if (keyword.name == "*DAMPING")
        {
          const auto value = [&](const std::string &name)
          { return keyword.value(name).empty() ? 0. : lines.real(keyword.value(name)); };
          material->mass_damping      = value("ALPHA");
          material->stiffness_damping = value("BETA");
          material->loss_factor       = value("STRUCTURAL");
        }
        else
        {
          std::string type = keyword.value("TYPE");
          type.erase(std::remove(type.begin(), type.end(), ' '), type.end());
          const bool has_constants = type == "ENGINEERINGCONSTANTS";
          if (!type.empty() && type != "ISOTROPIC" && type != "ISO" && !has_constants)
          {
            material->problem =
                where + ": *ELASTIC, TYPE=" + type +
                "; allowed are ISOTROPIC and ENGINEERING CONSTANTS (E1, E2, E3, nu12, "
                "nu13, nu23, G12, G13, G23), as which orthotropic stiffnesses can be "
                "written.";
            return;
          }
          std::vector<double> values;
          for (std::size_t row = 0; row < data.size(); ++row)
            for (std::size_t k = 0; k < data[row].size(); ++k)
              if (!data[row][k].empty())
                values.push_back(number(row, k));
          const std::size_t n = has_constants ? 9 : 2;
          if (values.size() < n)
            fail(" needs " + std::to_string(n) + " numbers.");
          if (data.size() > (n == 9 ? 2 : 1))
            pass_over("values at other temperatures than the first");
          values.resize(n);
          material->elastic = values;
        }
      }

      void take_orientation()
      {
        if ((!keyword.value("SYSTEM").empty() && keyword.value("SYSTEM") != "RECTANGULAR") ||
            (keyword.has("DEFINITION") && keyword.value("DEFINITION") != "COORDINATES") ||
            data.empty() || data[0].size() < 6)
        {
          pass_over("only SYSTEM=RECTANGULAR by coordinates");
          return;
        }
        DeckOrientation &orientation =
            model.orientations[scope.empty() ? option("NAME") : scope + "." + option("NAME")];
        for (unsigned int d = 0; d < 3; ++d)
        {
          orientation.first[d]    = number(0, d);
          orientation.in_plane[d] = number(0, 3 + d);
        }
        if (data.size() > 1 && number_or_zero(1, 1) != 0)
        {
          const Tensor<1, 3> z = cross_product_3d(orientation.first, orientation.in_plane);
          const std::array<Tensor<1, 3>, 3> axes = {
              {orientation.first, cross_product_3d(z, orientation.first), z}};
          const unsigned int about = std::clamp(number_or_zero(1, 0), 1., 3.) - 1;
          const double angle       = number(1, 1) * std::acos(-1.) / 180;
          for (Tensor<1, 3> *direction : {&orientation.first, &orientation.in_plane})
            *direction = turned(*direction, axes[about], angle);
        }
      }

      void take_transform()
      {
        DeckTransform transform;
        const std::string type = keyword.value("TYPE");
        if ((!type.empty() && type != "R" && type != "C") || data.empty() || data[0].size() < 6)
          return not_read(DeckMeaning::holds, "only TYPE=R and TYPE=C with six numbers");
        transform.nodes          = option("NSET");
        transform.is_cylindrical = type == "C";
        transform.where          = where;
        for (unsigned int d = 0; d < 3; ++d)
        {
          transform.first[d]    = number(0, d);
          transform.in_plane[d] = number(0, 3 + d);
        }
        if (transform.is_cylindrical) // two points of the axis
          transform.first = transform.in_plane - transform.first;
        model.transforms.push_back(transform);
      }

      void take_supports()
      {
        static const std::map<std::string, std::set<unsigned int>> by_name = {
            {"ENCASTRE", {0, 1, 2}},
            {"PINNED", {0, 1, 2}},
            {"XSYMM", {0}},
            {"YSYMM", {1}},
            {"ZSYMM", {2}}};
        if (replaces_all())
          model.supports.clear();
        for (std::size_t row = 0; row < data.size(); ++row)
        {
          const std::vector<std::string> &fields = data[row];
          if (fields.size() < 2)
            continue;
          const std::string name = deck_label(fields[0]);
          DeckSupport support{
              names_a_node(name) ? blocks_of_supports.set_of_nodes(fields) : name, {}, where};
          if (const auto named = by_name.find(deck_label(fields[1])); named != by_name.end())
            support.components = named->second;
          else
          {
            const bool has_last = fields.size() > 2 && !fields[2].empty();
            const long first    = lines.integer(fields[1]),
                       last     = has_last ? lines.integer(fields[2]) : first;
            for (long d = std::max(1l, first); d <= std::min(3l, last); ++d)
              support.components.insert(d - 1);
            if (fields.size() > 3 && !fields[3].empty() && number(row, 3) != 0)
            {
              not_read(DeckMeaning::holds,
                       "a prescribed displacement of " + support.nodes +
                           ": write its force as a pressure, and 0 where it holds");
              continue;
            }
          }
          model.supports.push_back(support);
        }
      }

      DeckLines lines;
      DeckKeyword keyword;
      std::vector<std::vector<std::string>> data;
      std::string where, scope, interaction;
      SupportBlocks blocks_of_supports;
      DeckMaterial *material = nullptr;

      struct Load
      {
        std::string surface;
        std::optional<unsigned int> component; ///< of a force
        double value = 0;
        std::string where;
        std::string problem; ///< why it is not read
      };
      bool is_perturbation = false, expands = false;
      double period = 1;                                ///< of the step
      std::set<std::string> cleared;                    ///< by OP=NEW in the step
      std::map<std::array<std::string, 3>, Load> loads; ///< by keyword, set, type
      std::map<std::string, std::vector<double>> amplitudes, motions;
      std::string general_contact, heated; ///< where
      std::vector<DeckContact> included, assigned;
      std::map<std::string, std::vector<DeckSection>> sections_of_part;
      DeckModel model;
    };
  } // namespace

  DeckModel read_deck_model(std::istream &in, const std::string &filename)
  {
    return DeckModelReader(in, filename).read();
  }
} // namespace squeal
