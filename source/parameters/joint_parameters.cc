#include <squeal/parameters/declare.h>
#include <squeal/parameters/entries.h>
#include <squeal/parameters/parameters.h>

#include <deal.II/base/utilities.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

// The section Joints: its keys, then one list after the other (points, masses, springs, dashpots,
// links, ties, contacts, superelements) as values, each with errors that tell the key and what is
// allowed, then the rules across lists.

namespace squeal
{
  namespace Parameters
  {
    using dealii::Utilities::split_string_list;

    namespace
    {
      [[noreturn]] void refuse(const std::string &key, const std::string &text,
                               const std::vector<std::string> &entry, const std::string &wanted)
      {
        std::string words;
        for (const std::string &word : entry)
          words += (words.empty() ? "" : " : ") + word;
        throw InputError("Joints/" + key + " = " + text + ": '" + words + "' is not " + wanted +
                         "; entries are separated by commas.");
      }

      using Axes = std::array<std::array<double, 3>, 3>;

      /// Unit vectors x', y', z' from "x'" or "x' and a second vector", which lies in the plane of
      /// x' and y'. With one alone y' is any direction across it. False if that says nothing.
      bool read_axes(const std::string &text, Axes &axes, bool &has_second)
      {
        std::vector<double> numbers;
        if (!read_numbers(text, numbers) || (numbers.size() != 3 && numbers.size() != 6))
          return false;
        using Vector   = std::array<double, 3>;
        const auto dot = [](const Vector &a, const Vector &b)
        { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
        const auto normalise = [&](Vector &a)
        {
          const double length = std::sqrt(dot(a, a));
          for (double &x : a)
            x /= length;
          return length > 0 && std::isfinite(length);
        };
        has_second = numbers.size() == 6;
        std::copy_n(numbers.begin(), 3, axes[0].begin());
        if (!normalise(axes[0]))
          return false;
        Vector second = {};
        if (has_second)
          std::copy_n(numbers.begin() + 3, 3, second.begin());
        else
          second[std::min_element(axes[0].begin(), axes[0].end(),
                                  [](const double a, const double b)
                                  { return std::abs(a) < std::abs(b); }) -
                 axes[0].begin()] = 1;
        if (!normalise(second))
          return false;
        const double along = dot(second, axes[0]);
        for (unsigned int d = 0; d < 3; ++d)
          axes[1][d] = second[d] - along * axes[0][d];
        if (!(dot(axes[1], axes[1]) > 1e-12) || !normalise(axes[1]))
          return false;
        for (unsigned int d = 0; d < 3; ++d)
          axes[2][d] = axes[0][(d + 1) % 3] * axes[1][(d + 2) % 3] -
                       axes[0][(d + 2) % 3] * axes[1][(d + 1) % 3];
        return true;
      }

      /// Connections "point : point or ground : values" of 3 or 6 values, if wanted with axes, or
      /// without values.
      std::vector<Joints::Connection> connections_of(const std::string &key,
                                                     const std::string &text,
                                                     const bool with_values,
                                                     const std::string &wanted)
      {
        std::vector<Joints::Connection> result;
        for (const std::vector<std::string> &entry : entries_of(text))
        {
          const bool has_axes = with_values && entry.size() == 4;
          if ((entry.size() != (with_values ? 3 : 2) && !has_axes) || entry[0].empty() ||
              entry[1].empty())
            refuse(key, text, entry, wanted);
          Joints::Connection connection{entry[0], entry[1]};
          if (with_values)
          {
            std::vector<double> values;
            if (!read_numbers(entry[2], values) || (values.size() != 3 && values.size() != 6) ||
                *std::min_element(values.begin(), values.end()) < 0)
              refuse(key, text, entry, wanted);
            std::copy(values.begin(), values.end(), connection.values.begin());
          }
          bool has_second = false;
          if (has_axes && !read_axes(entry[3], connection.axes, has_second))
            refuse(key, text, entry,
                   wanted + ", with axes as three numbers (x') or six (x' and a vector in the "
                            "plane of x' and y', not along x')");
          if (has_axes && !has_second &&
              (connection.values[1] != connection.values[2] ||
               connection.values[4] != connection.values[5]))
            refuse(key, text, entry,
                   wanted + ": with x' alone the values along (and about) y' and z' must be equal; "
                            "give a second vector, in the plane of x' and y'");
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
          "Surface groups of the scene mesh that are tied, meshes not matching: surface : "
          "surface, and so on, plane, oblique or curved. The first of a pair has the "
          "multipliers: take the softer or finer side, the smaller one if one is larger. Both "
          "belong to the rotor or both do not. With a third part, : partly, faces of the first of "
          "which less than half is covered stay free.");
      prm.add_parameter(
          "Contacts", contacts,
          "Surface groups of bodies that do not turn and touch without sliding, meshes not "
          "matching: surface : surface : frictionless, or surface : surface : stick, if wanted "
          "with the friction coefficient up to which it sticks (stick 0.3: more is warned of); "
          "and so on. The static state decides where they touch. The first of a pair has the "
          "multipliers.");
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
          "on. In other axes: a fourth part, : x', or : x' and a vector in the plane of x' and "
          "y'.");
      prm.add_parameter(
          "Dashpots", dashpots,
          "point : point or ground : cx cy cz, and if wanted c about x y z; N s/m and N m s; and "
          "so on. Axes as of springs.");
      prm.add_parameter("Rigid links", links,
                        "point : point or ground, and so on: the second moves as if it were "
                        "rigidly fixed to the first.");
      prm.add_parameter(
          "Superelements", superelements,
          "Parts known by their matrices: name : files : surface group, if wanted "
          ": surface group and so on; and so on. The files are <files>-K.mtx, -M.mtx, "
          "if it is there -D.mtx, and <files>-nodes.csv. Nodes within Position "
          "tolerance of the surfaces are held to them.");
    }

    std::vector<std::pair<std::string, std::string>> Joints::tied_surfaces() const
    {
      std::vector<std::pair<std::string, std::string>> result;
      for (const std::vector<std::string> &entry : entries_of(ties))
      {
        if ((entry.size() != 2 && (entry.size() != 3 || entry[2] != "partly")) ||
            entry[0].empty() || entry[1].empty())
          refuse("Ties", ties, entry,
                 "a pair; allowed is surface : surface, or surface : surface : partly");
        result.emplace_back(entry[0], entry[1]);
      }
      return result;
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

    bool Joints::has_point(const std::string &name) const
    {
      const std::vector<Point> list = list_of_points();
      return std::any_of(list.begin(), list.end(),
                         [&](const Point &point) { return point.name == name; });
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

    std::vector<Joints::Superelement> Joints::list_of_superelements() const
    {
      std::vector<Superelement> result;
      for (const std::vector<std::string> &entry : entries_of(superelements))
      {
        if (entry.size() < 3 || std::any_of(entry.begin(), entry.end(),
                                            [](const std::string &word) { return word.empty(); }))
          refuse("Superelements", superelements, entry, "name : files : surface [: surface ...]");
        Superelement element{entry[0], entry[1], {entry.begin() + 2, entry.end()}};
        for (const Superelement &other : result)
          if (other.name == element.name)
            refuse("Superelements", superelements, entry,
                   "another one: there are two superelements '" + element.name + "'");
        std::vector<std::string> surfaces = element.surfaces;
        std::sort(surfaces.begin(), surfaces.end());
        if (std::adjacent_find(surfaces.begin(), surfaces.end()) != surfaces.end())
          refuse("Superelements", superelements, entry,
                 "name : files : surface [: surface ...], each surface once");
        result.push_back(std::move(element));
      }
      return result;
    }

    std::pair<std::string, std::vector<std::string>> Output::superelement_of() const
    {
      std::vector<std::string> words  = split_string_list(superelement, ':');
      std::vector<std::string> sorted = words;
      std::sort(sorted.begin(), sorted.end());
      if (words.size() < 2 || sorted.front().empty() ||
          std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
        throw InputError("Output/Superelement = " + superelement +
                         ": it is not body : surface [: surface ...], each surface once.");
      const std::string body = words.front();
      words.erase(words.begin());
      return {body, words};
    }

    void Joints::check() const
    {
      tied_surfaces();
      list_of_contacts();
      list_of_superelements();
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
