#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/deck_lines.h>
#include <squeal/mesh_files/deck_model.h>

#include <algorithm>

// What a deck says beside its mesh: DeckModelReader goes over the blocks of a deck once. Each
// keyword comes with all of its data lines (large ones of the mesh are skipped, another reader has
// them); take() hands them to the function of that keyword, which fills the DeckModel: materials,
// sections, orientations, surfaces, contact, supports, loads, lumped elements. Keywords that say
// nothing about the model are passed over in silence, unknown ones are named in the model's list,
// so that no part of a deck is dropped unseen.

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// Whether a keyword concerns the mesh or output only.
    bool is_of_mesh_or_output(const std::string &name)
    {
      static const std::set<std::string> mesh = {
          "*HEADING",        "*ELSET",           "*SURFACE",
          "*ASSEMBLY",       "*END ASSEMBLY",    "*STEP",
          "*END STEP",       "*END INSTANCE",    "*PREPRINT",
          "*OUTPUT",         "*NODE OUTPUT",     "*EL FILE",
          "*ELEMENT OUTPUT", "*NODE FILE",       "*CONTACT OUTPUT",
          "*ENERGY OUTPUT",  "*NODE PRINT",      "*EL PRINT",
          "*CONTACT FILE",   "*CONTACT PRINT",   "*RESTART",
          "*MONITOR",        "*SYSTEM",          "*FILE FORMAT",
          "*DISTRIBUTING",   "*SURFACE BEHAVIOR"};
      return mesh.count(name) > 0;
    }

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
        return std::move(model);
      }

    private:
      void pass_over(const std::string &why = "")
      {
        model.passed_over.push_back(where + ": " + keyword.name + (why.empty() ? "" : ", ") + why);
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
        if (is_of_mesh_or_output(name))
          return;
        if (name == "*PART")
          scope = "part " + option("NAME");
        else if (name == "*END PART")
          scope.clear();
        else if (name == "*INSTANCE")
          for (DeckSection section : sections_of_part["part " + option("PART")])
          {
            section.volume = option("NAME") + "." + section.volume;
            model.sections.push_back(section);
          }
        else if (name == "*SOLID SECTION")
          (scope.empty() ? model.sections : sections_of_part[scope])
              .push_back({option("ELSET"), option("MATERIAL"), keyword.value("ORIENTATION")});
        else if (name == "*NODE" || name == "*NSET" || name == "*ELEMENT")
          take_mesh();
        else if (name == "*MATERIAL")
          material = &model.materials[option("NAME")];
        else if (name == "*ELASTIC" || name == "*DENSITY" || name == "*DAMPING")
          take_material();
        else if (name == "*ORIENTATION")
          take_orientation();
        else if (name == "*TIE")
        {
          for (const std::vector<std::string> &fields : data)
            if (fields.size() > 1)
              model.ties.emplace_back(deck_label(fields[0]), deck_label(fields[1]));
        }
        else if (name == "*CONTACT PAIR")
        {
          for (const std::vector<std::string> &fields : data)
            if (fields.size() > 1)
              model.contacts.push_back(
                  {deck_label(fields[0]), deck_label(fields[1]), keyword.value("INTERACTION")});
        }
        else if (name == "*SURFACE INTERACTION")
          interaction = option("NAME");
        else if (name == "*FRICTION" && !data.empty())
          model.friction[interaction] = number(0, 0);
        else if (name == "*BOUNDARY")
          take_supports();
        else if (name == "*DSLOAD")
        {
          for (std::size_t row = 0; row < data.size(); ++row)
            if (data[row].size() > 2 && deck_label(data[row][1]) == "P")
              model.pressures.emplace_back(deck_label(data[row][0]), number(row, 2));
            else
              pass_over("load of another type than P");
        }
        else if (name == "*SPRING" || name == "*DASHPOT" || name == "*MASS")
          take_lumped();
        else if (name == "*COUPLING")
          model.surface_of_node[keyword.value("REF NODE")] = option("SURFACE");
        else if (name == "*KINEMATIC")
          pass_over("the coupling is taken as *DISTRIBUTING, the mean motion of the surface");
        else if ((name == "*COMPLEX FREQUENCY" || name == "*FREQUENCY") && !data.empty())
        {
          const auto value = [&](const std::size_t column)
          { return column < data[0].size() && !data[0][column].empty() ? number(0, column) : 0.; };
          model.n_modes = value(0);
          if (value(2) > 0)
          {
            model.frequency        = value(2);
            model.lowest_frequency = value(1);
          }
        }
        else if (name == "*MOTION" && keyword.has("ROTATION") && !data.empty())
        {
          model.speed         = number(0, 1);
          model.speed_is_told = true;
          for (std::size_t k = 2; k < std::min<std::size_t>(8, data[0].size()); ++k)
            model.axis.push_back(number(0, k));
        }
        else
          pass_over();
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
            material->problem = where + ": *ELASTIC, TYPE=" + type +
                                "; allowed are ISOTROPIC and ENGINEERING CONSTANTS.";
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
            data.empty() || data[0].size() < 6)
        {
          pass_over("only SYSTEM=RECTANGULAR by coordinates");
          return;
        }
        DeckOrientation &orientation = model.orientations[option("NAME")];
        for (unsigned int d = 0; d < 3; ++d)
        {
          orientation.first[d]    = number(0, d);
          orientation.in_plane[d] = number(0, 3 + d);
        }
        if (data.size() > 1)
          pass_over("a further rotation of " + option("NAME"));
      }

      void take_supports()
      {
        static const std::map<std::string, std::set<unsigned int>> by_name = {
            {"ENCASTRE", {0, 1, 2}},
            {"PINNED", {0, 1, 2}},
            {"XSYMM", {0}},
            {"YSYMM", {1}},
            {"ZSYMM", {2}}};
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
              pass_over("a prescribed displacement of " + support.nodes);
              continue;
            }
          }
          if (!support.components.empty())
            model.supports.push_back(support);
        }
      }

      DeckLines lines;
      DeckKeyword keyword;
      std::vector<std::vector<std::string>> data;
      std::string where, scope, interaction;
      SupportBlocks blocks_of_supports;
      DeckMaterial *material = nullptr;
      std::map<std::string, std::vector<DeckSection>> sections_of_part;
      DeckModel model;
    };
  } // namespace

  DeckModel read_deck_model(std::istream &in, const std::string &filename)
  {
    return DeckModelReader(in, filename).read();
  }
} // namespace squeal
