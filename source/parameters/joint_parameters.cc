#include <squeal/parameters/declare.h>
#include <squeal/parameters/parameters.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace squeal
{
  namespace Parameters
  {
    using dealii::Utilities::split_string_list;

    namespace
    {
      /// The entries of a list "a : b : 1 2 3, c : ...", each as its words between colons.
      std::vector<std::vector<std::string>> entries_of(const std::string &text)
      {
        std::vector<std::vector<std::string>> result;
        if (text.empty())
          return result;
        for (const std::string &entry : split_string_list(text, ','))
          result.push_back(split_string_list(entry, ':'));
        return result;
      }

      /// Numbers between blanks; false for anything else.
      bool read_numbers(const std::string &text, std::vector<double> &numbers)
      {
        numbers.clear();
        for (const std::string &word : split_string_list(text, ' '))
          if (!word.empty())
          {
            try
            {
              numbers.push_back(dealii::Utilities::string_to_double(word));
            }
            catch (const dealii::ExceptionBase &)
            {
              return false;
            }
            if (!std::isfinite(numbers.back()))
              return false;
          }
        return !numbers.empty();
      }

      [[noreturn]] void refuse(const std::string &key, const std::string &text,
                               const std::vector<std::string> &entry, const std::string &wanted)
      {
        std::string words;
        for (const std::string &word : entry)
          words += (words.empty() ? "" : " : ") + word;
        throw InputError("Joints/" + key + " = " + text + ": '" + words + "' is not " + wanted +
                         "; entries are separated by commas.");
      }

      /// Connections "point : point or ground : values" of 3 or 6 values, or without values.
      std::vector<Joints::Connection> connections_of(const std::string &key,
                                                     const std::string &text,
                                                     const bool with_values,
                                                     const std::string &wanted)
      {
        std::vector<Joints::Connection> result;
        for (const std::vector<std::string> &entry : entries_of(text))
        {
          if (entry.size() != (with_values ? 3 : 2) || entry[0].empty() || entry[1].empty())
            refuse(key, text, entry, wanted);
          Joints::Connection connection{entry[0], entry[1], {}};
          if (with_values)
          {
            std::vector<double> values;
            if (!read_numbers(entry[2], values) || (values.size() != 3 && values.size() != 6) ||
                *std::min_element(values.begin(), values.end()) < 0)
              refuse(key, text, entry, wanted);
            std::copy(values.begin(), values.end(), connection.values.begin());
          }
          result.push_back(connection);
        }
        return result;
      }
    } // namespace

    void Joints::declare(ParameterHandler &prm)
    {
      const Subsection section(prm, "Joints");
      prm.add_parameter(
          "Ties", ties,
          "Surface groups of the scene mesh that are tied, meshes not matching: surface : surface, "
          "and so on, plane, oblique or curved. The first of a pair has the multipliers: take the "
          "softer or finer side, the smaller one if one is larger. Both belong to the rotor or "
          "both "
          "do not.");
      prm.add_parameter(
          "Contacts", contacts,
          "Surface groups of bodies that do not turn and touch without sliding, meshes not "
          "matching: "
          "surface : surface : frictionless, or surface : surface : stick, if wanted with the "
          "friction coefficient up to which it sticks (stick 0.3: more is warned of); and so on. "
          "The "
          "static state decides where they touch. The first of a pair has the multipliers.");
      prm.add_parameter(
          "Position tolerance", position_tolerance,
          "Largest distance of joined surfaces, m; 0: 5 % of the longest edge of their "
          "faces. A distance within it is closed without moving nodes.",
          not_negative());
      prm.add_parameter(
          "Points", points,
          "Points that carry masses, springs, dashpots and rigid links: name : surface group, the "
          "mean motion of a surface, or name : x y z (m), a point in space; and so on.");
      prm.add_parameter("Masses", masses,
                        "point : mass, or point : mass Ixx Iyy Izz, kg and kg m^2 about the point; "
                        "and so on.");
      prm.add_parameter(
          "Springs", springs,
          "point : point or ground : kx ky kz, and if wanted k about x y z; N/m and N m; and so "
          "on.");
      prm.add_parameter(
          "Dashpots", dashpots,
          "point : point or ground : cx cy cz, and if wanted c about x y z; N s/m and N m s; and "
          "so on.");
      prm.add_parameter("Rigid links", links,
                        "point : point or ground, and so on: the second moves as if it were "
                        "rigidly fixed to the first.");
    }

    std::vector<std::pair<std::string, std::string>> Joints::tied_surfaces() const
    {
      return pairs_of_names("Joints/Ties", ties, "surface : surface");
    }

    std::vector<Joints::Contact> Joints::list_of_contacts() const
    {
      const std::string wanted = "surface : surface : frictionless, surface : surface : stick, or "
                                 "that with a friction coefficient above zero";
      std::vector<Contact> result;
      for (const std::vector<std::string> &entry : entries_of(contacts))
      {
        if (entry.size() != 3 || entry[0].empty() || entry[1].empty() || entry[0] == entry[1])
          refuse("Contacts", contacts, entry, wanted);
        const std::string kind = entry[2].substr(0, entry[2].find(' '));
        std::vector<double> friction;
        if ((kind != "stick" && kind != "frictionless") ||
            (kind != entry[2] &&
             (kind != "stick" || !read_numbers(entry[2].substr(kind.size()), friction) ||
              friction.size() != 1 || friction[0] <= 0)))
          refuse("Contacts", contacts, entry, wanted);
        result.push_back(
            {entry[0], entry[1], kind == "stick", friction.empty() ? 0. : friction[0]});
      }
      return result;
    }

    std::vector<Joints::Point> Joints::list_of_points() const
    {
      std::vector<Point> result;
      for (const std::vector<std::string> &entry : entries_of(points))
      {
        if (entry.size() != 2 || entry[0].empty() || entry[1].empty() || entry[0] == ground)
          refuse("Points", points, entry, "a point, name : surface or name : x y z");
        Point point{entry[0], entry[1], {}};
        std::vector<double> place;
        if (read_numbers(entry[1], place) && place.size() == 3)
        {
          point.surface.clear();
          std::copy(place.begin(), place.end(), point.place.begin());
        }
        result.push_back(point);
      }
      return result;
    }

    std::vector<Joints::Mass> Joints::list_of_masses() const
    {
      std::vector<Mass> result;
      for (const std::vector<std::string> &entry : entries_of(masses))
      {
        std::vector<double> values;
        if (entry.size() != 2 || !read_numbers(entry[1], values) ||
            (values.size() != 1 && values.size() != 4) ||
            *std::min_element(values.begin(), values.end()) < 0)
          refuse("Masses", masses, entry,
                 "point : mass or point : mass Ixx Iyy Izz, none negative");
        values.resize(4);
        result.push_back(
            {entry[0], {{values[0], values[0], values[0], values[1], values[2], values[3]}}});
      }
      return result;
    }

    std::vector<Joints::Connection> Joints::list_of_springs() const
    {
      return connections_of("Springs", springs, true,
                            "point : point or ground : kx ky kz [k about x y z], none negative");
    }

    std::vector<Joints::Connection> Joints::list_of_dashpots() const
    {
      return connections_of("Dashpots", dashpots, true,
                            "point : point or ground : cx cy cz [c about x y z], none negative");
    }

    std::vector<Joints::Connection> Joints::list_of_links() const
    {
      return connections_of("Rigid links", links, false, "point : point or ground");
    }

    void Joints::check() const
    {
      tied_surfaces();
      list_of_contacts();
      std::map<std::string, unsigned int> numbers;
      for (const Point &point : list_of_points())
        if (!numbers.emplace(point.name, numbers.size()).second)
          throw InputError("Joints/Points = " + points + ": there are two points '" + point.name +
                           "'.");
      numbers.emplace(ground, numbers.size());
      const auto need =
          [&](const std::string &key, const std::string &name, const bool may_be_ground)
      {
        if (numbers.count(name) > 0 && (may_be_ground || name != ground))
          return;
        std::string known;
        for (const auto &point : numbers)
          if (may_be_ground || point.first != ground)
            known += (known.empty() ? "" : ", ") + point.first;
        throw InputError("Joints/" + key + ": there is no point '" + name + "'; allowed are " +
                         (known.empty() ? "none, Joints/Points is empty" : known) + ".");
      };
      for (const Mass &mass : list_of_masses())
        need("Masses", mass.point, false);
      for (const auto &[key, list] : {std::make_pair("Springs", list_of_springs()),
                                      std::make_pair("Dashpots", list_of_dashpots()),
                                      std::make_pair("Rigid links", list_of_links())})
        for (const Connection &connection : list)
        {
          need(key, connection.first, false);
          need(key, connection.second, true);
          if (connection.first == connection.second)
            throw InputError("Joints/" + std::string(key) + ": '" + connection.first +
                             "' is connected with itself.");
        }
      // Points that are linked move as one: another link between them would say it twice.
      std::vector<unsigned int> group(numbers.size());
      for (unsigned int i = 0; i < group.size(); ++i)
        group[i] = i;
      for (const Connection &link : list_of_links())
      {
        const unsigned int a = group[numbers.at(link.first)], b = group[numbers.at(link.second)];
        if (a == b)
          throw InputError("Joints/Rigid links = " + links + ": the link " + link.first + " : " +
                           link.second + " closes a ring of links; one of the ring must go.");
        std::replace(group.begin(), group.end(), a, b);
      }
    }

    void All::check_joints() const
    {
      const std::string joint = "Section Joints: ";
      if (scene != Scene::mesh)
        throw InputError(joint + "joints connect the bodies of a mesh file; allowed with Scene = " +
                         name_of(scene) + " is none.");
      joints.check();
      if (eigenproblem.is_matrix_free())
        throw InputError(joint + "Eigenproblem/Solver = " + name_of(eigenproblem.solver) +
                         " has no joints; allowed are the others.");
      if (static_equilibrium.linear_solver == LinearSolver::iterative)
        throw InputError(joint + "Static equilibrium/Linear solver = iterative has no joints; "
                                 "allowed are auto and direct.");
      if (!joints.contacts.empty() && contact.formulation != Formulation::mortar)
        throw InputError("Contact/Formulation = " + name_of(contact.formulation) +
                         " does not go with Joints/Contacts; allowed is mortar.");
      if (!joints.contacts.empty() && prestress.turning_contact)
        throw InputError("Prestress/Turning contact does not go with Joints/Contacts, whose "
                         "directions do not turn; allowed is false.");
      if (contact.formulation == Formulation::mortar_penalty && n_pads() > 0)
        throw InputError(joint + "Contact/Formulation = mortar_penalty does not go with joints; "
                                 "allowed are mortar and penalty.");
    }
  } // namespace Parameters
} // namespace squeal
