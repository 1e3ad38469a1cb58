#include <squeal/base/text.h>
#include <squeal/parameters/declare.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/parameters.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <set>

namespace squeal
{
  namespace Parameters
  {
    using dealii::Utilities::split_string_list;

    void MeshPart::declare(ParameterHandler &prm)
    {
      prm.add_parameter("Volumes", volumes,
                        "Names of the volume groups that are made of this section's material; "
                        "empty: the section is not used. A file can have as many sections Part 1, "
                        "Part 2, ... as it needs, up to 200.");
      add_choice(prm, "Body", body,
                 "What the volumes belong to. parts: bodies that neither turn nor touch the rotor "
                 "and hang on others by Joints.");
      material.declare(prm);
    }

    void Mesh::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Mesh");
      prm.add_parameter("File", file,
                        "Mesh of tetrahedra, wedges and hexahedra, linear or of order 2: Gmsh "
                        "(.msh, version 2.2 or 4.1, text) or Abaqus and CalculiX (.inp).");
      prm.add_parameter("Scale", scale, "Metres per unit of length of the file; 1e-3 for mm.",
                        Patterns::Double(smallest));
      add_choice(prm, "Axis", axis,
                 "The file's coordinate along the rotor's axis. It becomes z: x y z are "
                 "exchanged cyclically.");
      prm.add_parameter("Origin", origin_text,
                        "A point of the rotor's axis, where z = 0, by its coordinates in the "
                        "file: in its unit of length, before Scale.",
                        Patterns::List(Patterns::Double(), 3, 3, ","));
      add_choice(
          prm, "Curved bodies", curved,
          "Bodies whose cells between the nodes follow circles about the axis. The others have "
          "the edges of their elements: straight ones, or through middle nodes. Transport needs a "
          "rotor that does.");
      add_choice(prm, "Tetrahedra", divided,
                 "What displacements are on tetrahedra and wedges. own: polynomials of "
                 "Discretization/Degree on the element, at degree 2 by the nodes of the file. "
                 "divided: those of the hexahedra that it is divided into, for adaptive meshes; 17 "
                 "to 21 times as many unknowns.");
      prm.add_parameter("Refinements", refinements,
                        "How often every element of the file is divided into eight, with new nodes "
                        "on its shape, before anything is made of it.",
                        Patterns::Integer(0, 4));
      prm.add_parameter("Rotor", rotor,
                        "Names of the rotor's volume groups, of the material Rotor/Material. Empty "
                        "where parts are studied alone.");
      prm.add_parameter("Pads", pads,
                        "Names of volume groups of the pads (linings), of the material "
                        "Pads/Material. Empty: none.");
      add_choice(prm, "Other volumes", others,
                 "What becomes of elements in no volume of Rotor, Pads or a Part. left_out: they "
                 "are not there, for instance where parts of an assembly are studied alone.");
      prm.add_parameter("Contact pairs", contact_pairs,
                        "Surface groups that touch: pad surface : rotor surface, and so on. Plane, "
                        "across the axis.");
      prm.add_parameter("Contact tolerance", contact_tolerance,
                        "Largest gap or overlap of a contact pair in the mesh, m; it is closed "
                        "without moving nodes. 0: 1e-4 of the pad's size.",
                        not_negative());
      prm.add_parameter("Pressure on", pressure_on,
                        "Names of surface groups under Pads/Pressure times Pads/Pressure profile.");
      prm.add_parameter(
          "Pressures", pressures,
          "Surface groups with a pressure of their own: surface : value in Pa, and so on, against "
          "the outward normal. It adds to that of Pressure on; Pads/Pressure and its profile leave "
          "it as it is. Studies vary Mesh/Pressures/surface.");
      prm.add_parameter("Clamped", clamped,
                        "Names of surface groups on which all displacements are zero.");
      prm.add_parameter("Guided", guided,
                        "Names of surface groups that move along the axis only: in-plane fixed.");
      const std::array<std::string, 3> names = {{"x", "y", "z"}};
      for (unsigned int c = 0; c < 3; ++c)
        prm.add_parameter("Fixed in " + names[c], fixed[c],
                          "Names of surface groups on which the displacement along " + names[c] +
                              " (after Axis) is zero.");
      for (unsigned int k = 0; k < parts.size(); ++k)
      {
        const Subsection section(prm, "Part " + std::to_string(k + 1));
        parts[k].declare(prm);
      }
    }

    std::vector<std::pair<std::string, std::string>>
    pairs_of_names(const std::string &key, const std::string &text, const std::string &wanted)
    {
      std::vector<std::pair<std::string, std::string>> result;
      if (text.empty())
        return result;
      for (const std::string &pair : split_string_list(text, ','))
      {
        const std::vector<std::string> sides = split_string_list(pair, ':');
        if (sides.size() != 2 || sides[0].empty() || sides[1].empty())
          throw InputError(key + " = " + text + ": '" + pair + "' is not a pair; allowed is " +
                           wanted + ", pairs separated by commas.");
        result.emplace_back(sides[0], sides[1]);
      }
      return result;
    }

    std::vector<std::pair<std::string, std::string>> Mesh::pairs() const
    {
      return pairs_of_names("Mesh/Contact pairs", contact_pairs, "pad surface : rotor surface");
    }

    namespace
    {
      std::vector<std::pair<std::string, double>> read_pressures(const std::string &text)
      {
        const std::string key = "Mesh/Pressures", wanted = "surface : pressure in Pa";
        std::vector<std::pair<std::string, double>> result;
        std::set<std::string> seen;
        for (const auto &[surface, value] : pairs_of_names(key, text, wanted))
        {
          const std::optional<double> number = to_number(value);
          if (!number)
            throw InputError(key + " = " + text + ": '" + value + "' is not a number; allowed is " +
                             wanted + ", pairs separated by commas.");
          if (!seen.insert(surface).second)
            throw InputError(key + " = " + text + ": '" + surface +
                             "' is named twice; write the sum of its pressures.");
          result.emplace_back(surface, *number);
        }
        return result;
      }
    } // namespace

    std::string Mesh::pressures_with(const std::string &surface, const double value,
                                     const std::string &where) const
    {
      std::string list, known;
      bool found = false;
      for (const auto &[name, present] : read_pressures(pressures))
      {
        list += (list.empty() ? "" : ", ") + name + " : " +
                number(name == surface ? value : present, 17);
        known += (known.empty() ? "" : ", ") + name;
        found = found || name == surface;
      }
      if (!found)
        throw InputError(where + ": " + pressure_path + surface + ": Mesh/Pressures has " +
                         (known.empty() ? "no surfaces" : known) + ", as they are written there.");
      return list;
    }

    bool Mesh::is_loaded(const double pads_pressure) const
    {
      return (pads_pressure != 0 && !pressure_on.empty()) ||
             std::any_of(surface_pressures.begin(), surface_pressures.end(),
                         [](const auto &entry) { return entry.second != 0; });
    }

    std::array<double, 3> Mesh::origin() const
    {
      const std::vector<std::string> words = split_string_list(origin_text, ',');
      std::array<double, 3> result{};
      for (unsigned int d = 0; d < 3; ++d)
        result[d] = to_number(words[d]).value();
      return result;
    }

    void Mesh::check()
    {
      surface_pressures = read_pressures(pressures);
      if (file.empty())
        throw InputError("Mesh/File: the scene mesh needs the name of a mesh file, .msh or .inp.");
      if (rotor.empty() && !pairs().empty())
        throw InputError("Mesh/Rotor: the scene mesh needs the names of the rotor's volumes. Only "
                         "parts that are studied alone, without contact pairs, need none.");
      const bool has_pads =
          !pads.empty() || std::any_of(parts.begin(), parts.end(),
                                       [](const MeshPart &part) {
                                         return !part.volumes.empty() && part.body == PartOf::pads;
                                       });
      if (has_pads && pairs().empty())
        throw InputError("Mesh/Contact pairs: pads need them, as pad surface : rotor surface.");
      if (!has_pads && !pairs().empty())
        throw InputError("Mesh/Pads: the contact pairs " + contact_pairs +
                         " need pads, the names of their volumes.");
    }
  } // namespace Parameters
} // namespace squeal
