#include <squeal/base/errors.h>
#include <squeal/base/files.h>
#include <squeal/parameters/parameter_file.h>
#include <squeal/scenes/deck_parameters.h>
#include <squeal/scenes/deck_sections.h>
#include <squeal/scenes/make_scene.h>

#include <algorithm>
#include <map>
#include <set>
#include <sstream>

// What a deck says beside its mesh (deck_model.h) becomes a parameter file. DeckWriter writes it
// from top to bottom: Mesh with its supports and loads, materials, joints, operation, friction, and
// at the end what was passed over. What the deck and its mesh mean is in DeckAssembly; each subject
// has a file of its own (deck_sections.h). The file is read back, with its mesh.

namespace squeal
{
  using namespace deck_text;

  namespace
  {
    class DeckWriter
    {
    public:
      explicit DeckWriter(DeckAssembly &&assembly) : all(std::move(assembly)) {}

      std::string write()
      {
        if (!all.units_doubt.empty())
          out << "# " << all.units_doubt << "\n";
        out << "# Written by squeal --from-deck " << all.mesh.name
            << ". Look it through: what it passed over\n# is listed at the end. Units: "
            << (all.length == 1
                    ? "the deck's are taken as m, kg, s."
                    : "the deck's are taken as mm, t, s, N, MPa; here all are m, kg, s.")
            << "\n\nset Scene = mesh\nset Stage = " << (all.pairs.empty() ? "elastic" : "full")
            << "\n";
        write_mesh();
        write_materials();
        if (const std::vector<DeckSetting> joints = deck_joints(all); !joints.empty())
          section("Joints", joints);
        mark(DeckMeaning::joins);
        write_operation();
        mark(DeckMeaning::turns);
        out << deck_friction(all);
        mark(DeckMeaning::rubs);
        section("Discretization", {{"Degree", "2"}});
        write_window();
        write_passed_over();
        return out.str();
      }

    private:
      /// Says at its place in the file what of a meaning is left out.
      void mark(const DeckMeaning meaning)
      {
        for (const auto &[carries, what] : all.unread)
          if (carries == meaning)
            out << "  # Left out: " << what << "\n";
      }

      /// What the reader of the deck did not read, and elements that no keyword read.
      void take_unread()
      {
        all.unread = all.deck.not_read;
        std::set<std::string> seen;
        for (const DeckSection &of : all.deck.sections)
          if (seen.insert(of.material).second)
            for (const std::string &what : all.deck.materials.at(of.material).unread)
              all.leave_out(DeckMeaning::body, what);
        static const std::set<std::string> lumped = {"MASS",     "SPRINGA",  "SPRING1", "SPRING2",
                                                     "DASHPOTA", "DASHPOT1", "DASHPOT2"};
        for (const auto &[type, n] : all.mesh.passed_over)
          if (lumped.count(type) == 0)
            all.leave_out(DeckMeaning::joins, std::to_string(n) + " elements of type " + type);
        check_interactions(all);
      }

      void write_mesh()
      {
        out << "\nsubsection Mesh\n";
        line("File", file_name());
        line("Scale", digits(all.length));
        line("Axis", std::string(1, "xyz"[all.axis]),
             all.axis_is_told ? "" : "as the contact surfaces say");
        line("Origin",
             digits(all.origin[0]) + ", " + digits(all.origin[1]) + ", " + digits(all.origin[2]),
             "a point of the axis, units of the file");
        take_unread();
        mark(DeckMeaning::unknown);
        write_bodies();
        mark(DeckMeaning::body);
        lines(deck_supports(all));
        mark(DeckMeaning::holds);
        const DeckLoads loads = deck_loads(all);
        pressure              = loads.pads_pressure;
        lines(loads.of_mesh);
        mark(DeckMeaning::load);
        write_parts();
        out << "end\n";
      }

      void write_passed_over()
      {
        if (!all.unread.empty() && !all.options.partial)
        {
          std::string list;
          for (const auto &[meaning, what] : all.unread)
            list += "\n  " + what + " (" + name_of(meaning) + ")";
          all.fail("what follows carries load, holds, joins, turns or is not known, and cannot be "
                   "read. With --partial it is left out, and listed in the file:" +
                   list);
        }
        for (const auto &[meaning, what] : all.unread)
          all.deck.passed_over.push_back(what);
        if (!all.deck.passed_over.empty())
          out << "\n# Passed over:\n";
        for (const std::string &what : all.deck.passed_over)
          out << "#   " << what << "\n";
      }

      /// The deck's name as a value of a parameter file.
      std::string file_name() const
      {
        const std::string &name = all.mesh.name;
        if (name.find('"') != std::string::npos ||
            std::any_of(name.begin(), name.end(), [](const unsigned char c) { return c < 0x20; }))
          all.fail("a parameter file cannot hold this name; rename the deck.");
        return name.find_first_of("#\\ ") == std::string::npos ? name : "\"" + name + "\"";
      }

      void write_operation()
      {
        if (all.pairs.empty() && all.deck.speed == 0)
          return;
        if (!all.deck.speed_is_told && !all.options.speed)
          all.fail("the deck does not say how fast the rotor turns (*MOTION, ROTATION). Say it, in "
                   "rad/s: --speed VALUE.");
        section("Operation", {{"Angular velocity",
                               digits(all.options.speed ? *all.options.speed : all.deck.speed)}});
      }

      void write_window()
      {
        const double highest = all.deck.frequency > 0 ? all.deck.frequency : all.options.window;
        if (!(highest > 0))
          return;
        if (all.deck.frequency == 0)
          out << "\n# The deck asks for " << all.deck.n_modes
              << " modes: so many has the brake up to here, counted on elements of degree 1.";
        std::vector<DeckSetting> lines_of = {{"Maximum frequency", digits(highest)}};
        if (all.deck.lowest_frequency > 0 && all.deck.lowest_frequency < highest)
          lines_of.push_back({"Minimum frequency", digits(all.deck.lowest_frequency)});
        section("Eigenproblem", lines_of);
      }

      void line(const std::string &key, const std::string &value, const std::string &comment = "")
      {
        if (!value.empty())
          out << "  set " << key << " = " << value << (comment.empty() ? "" : "  # " + comment)
              << "\n";
      }

      void lines(const std::vector<DeckSetting> &settings)
      {
        for (const DeckSetting &setting : settings)
          line(setting.key, setting.value, setting.comment);
      }

      void section(const std::string &name, const std::vector<DeckSetting> &settings)
      {
        out << "\nsubsection " << name << "\n";
        lines(settings);
        out << "end\n";
      }

      void write_bodies()
      {
        std::map<DeckLaw, std::set<std::string>> of_rotor, of_pads, of_others;
        for (const DeckSection &of : all.deck.sections)
          (all.rotor.count(of.volume)  ? of_rotor
           : all.pads.count(of.volume) ? of_pads
                                       : of_others)[{of.material, of.orientation}]
              .insert(of.volume);
        if (all.rotor.empty())
          out << "  set Rotor =  # parts are studied alone\n";
        unsigned int n_parts = 0;
        const auto add = [&](std::map<DeckLaw, std::set<std::string>> &laws, const std::string &own,
                             const std::string &body)
        {
          for (const auto &[law, names] : laws)
            if (!own.empty() && &law == &laws.begin()->first)
            {
              line(own, list_of(names));
              laws_of_sections.emplace_back(own, law);
            }
            else
            {
              const std::string part = "Part " + std::to_string(++n_parts);
              parts.push_back({part, list_of(names), body});
              laws_of_sections.emplace_back(part, law);
            }
        };
        add(of_rotor, "Rotor", "rotor");
        add(of_pads, "Pads", "pads");
        add(of_others, "", "parts");
        std::string list;
        for (const DeckContact &pair : all.pairs)
          append(list, pair.first + " : " + pair.second);
        line("Contact pairs", list);
      }

      void write_parts()
      {
        for (const auto &[part, volumes_of, body] : parts)
          out << "  subsection " << part << "\n    set Volumes = " << volumes_of
              << "\n    set Body = " << body << "\n    subsection Material\n"
              << deck_material(all, law_of(part), "      ") << "    end\n  end\n";
      }

      const DeckLaw &law_of(const std::string &name) const
      {
        return std::find_if(laws_of_sections.begin(), laws_of_sections.end(),
                            [&](const auto &entry) { return entry.first == name; })
            ->second;
      }

      /// Material sections of rotor and pads, the latter with the pressure.
      void write_materials()
      {
        for (const std::string name : {"Rotor", "Pads"})
        {
          const bool has_material =
              std::any_of(laws_of_sections.begin(), laws_of_sections.end(),
                          [&](const auto &entry) { return entry.first == name; });
          const bool has_pressure = name == "Pads" && pressure != 0;
          if (!has_material && !has_pressure)
            continue;
          out << "\nsubsection " << name << "\n";
          if (has_pressure)
            line("Pressure", digits(pressure));
          if (has_material)
            out << "  subsection Material\n"
                << deck_material(all, law_of(name), "    ") << "  end\n";
          out << "end\n";
        }
      }

      struct PartLines
      {
        std::string name, volumes, body;
      };

      DeckAssembly all;
      double pressure = 0; ///< Pads/Pressure, Pa
      std::vector<PartLines> parts;
      std::vector<std::pair<std::string, DeckLaw>> laws_of_sections;
      std::ostringstream out;
    };
  } // namespace

  namespace
  {
    /// Throws InputError where a run would refuse the parameter file that was written, or its mesh.
    void read_back(const std::string &text, const std::string &filename)
    {
      try
      {
        ParameterFile file;
        file.read_text(filename, text);
        make_imported_scene(file.parameters());
      }
      catch (const InputError &error)
      {
        throw InputError("--from-deck " + filename +
                         ": a run would refuse the parameter file: " + error.what() +
                         "\nWith --partial the file is written all the same, to be mended.");
      }
    }
  } // namespace

  DeckParameters parameters_of_deck(const std::string &filename, const DeckOptions &options)
  {
    if (filename.size() < 4 || filename.substr(filename.size() - 4) != ".inp")
      throw InputError("--from-deck " + filename + ": a deck (.inp) is expected.");
    const ElementFile mesh = read_mesh_file(filename);
    std::ifstream in       = open_regular_file(filename);
    DeckModel deck         = read_deck_model(in, filename);
    DeckParameters result;
    if (deck.frequency == 0 && deck.n_modes >= 1)
      result.n_modes = deck.n_modes;
    result.text = DeckWriter(DeckAssembly(mesh, std::move(deck), options)).write();
    if (!options.partial)
      read_back(result.text, filename);
    return result;
  }
} // namespace squeal
