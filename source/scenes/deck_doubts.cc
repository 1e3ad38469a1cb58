#include <squeal/base/errors.h>
#include <squeal/base/files.h>
#include <squeal/base/text.h>
#include <squeal/mesh_files/deck_model.h>
#include <squeal/parameters/entries.h>
#include <squeal/scenes/deck_doubts.h>
#include <squeal/scenes/imported_mesh.h>

#include <set>
#include <vector>

namespace squeal
{
  namespace
  {
    /// Compares names of a deck with those of a parameter file.
    class DeckNames
    {
    public:
      /// Takes lists of the parameter file.
      void take(const std::initializer_list<std::string> lists)
      {
        for (const std::string &list : lists)
          for (const std::vector<std::string> &entry : Parameters::entries_of(list))
            for (const std::string &word : entry)
              names.insert(plain_capitals(word));
      }

      /// Returns whether a list has the name, or a plane part of it, NAME(1).
      bool has(const std::string &name) const
      {
        const std::string plain = plain_capitals(name);
        const auto part         = names.lower_bound(plain + "(");
        return names.count(plain) > 0 || (part != names.end() && part->rfind(plain + "(", 0) == 0);
      }

    private:
      std::set<std::string> names;
    };
  } // namespace

  std::string doubts_about_deck(const Parameters::All &prm)
  {
    const std::string &file = prm.mesh.file;
    if (file.size() < 4 || file.substr(file.size() - 4) != ".inp")
      return "";
    DeckModel deck;
    try
    {
      std::ifstream in = open_regular_file(file);
      deck             = read_deck_model(in, file);
    }
    catch (const InputError &error)
    {
      return text_of("Warning, deck: what it says beside its mesh is not looked through: ",
                     error.what(), "\n");
    }
    DeckNames held, loaded, joined;
    held.take({prm.mesh.clamped, prm.mesh.guided, prm.mesh.fixed[0], prm.mesh.fixed[1],
               prm.mesh.fixed[2]});
    loaded.take({prm.mesh.pressure_on, prm.mesh.pressures});
    joined.take({prm.mesh.contact_pairs, prm.joints.ties, prm.joints.contacts, prm.joints.points,
                 prm.joints.superelements});
    std::vector<std::string> missing;
    const auto need =
        [&](const DeckNames &names, const std::string &keyword, const std::string &name)
    {
      if (!names.has(name))
        missing.push_back(keyword + " " + name);
    };
    for (const DeckSupport &support : deck.supports)
      if (!support.components.empty())
        need(held, "*BOUNDARY", support.nodes);
    for (const DeckPressure &pressure : deck.pressures)
      need(loaded, "pressure on", pressure.surface);
    for (const DeckForce &force : deck.forces)
      need(loaded, "*CLOAD", force.nodes);
    for (const auto &[first, second] : deck.ties)
      for (const std::string &name : {first, second})
        need(joined, "*TIE", name);
    for (const DeckContact &contact : deck.contacts)
      for (const std::string &name : {contact.first, contact.second})
        need(joined, "*CONTACT PAIR", name);
    for (const auto &[node, surface] : deck.surface_of_node)
      need(joined, "*COUPLING", surface);
    if (!deck.lumped.empty() && prm.joints.masses.empty() && prm.joints.springs.empty() &&
        prm.joints.dashpots.empty())
      missing.push_back(deck.lumped[0].kind);
    for (const auto &[meaning, what] : deck.not_read)
      if (meaning != DeckMeaning::body && meaning != DeckMeaning::unknown)
        missing.push_back(what);
    std::set<std::string> seen;
    std::string list;
    for (const std::string &what : missing)
      if (seen.insert(what).second)
        list += (list.empty() ? "" : "; ") + what;
    if (list.empty())
      return "";
    return "Warning, deck: " + file +
           " is read as a mesh, and the parameter file names nothing of: " + list +
           ". squeal --from-deck writes a parameter file of all that can be read.\n";
  }
} // namespace squeal
