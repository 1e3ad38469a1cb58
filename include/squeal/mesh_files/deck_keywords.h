#pragma once

#include <map>
#include <string>

namespace squeal
{
  /// What a keyword of a deck carries: what would be wrong if it were not read.
  enum class DeckMeaning
  {
    silent,  ///< the mesh, sets, output, bookkeeping
    nothing, ///< procedures, controls, properties that no mode depends on: listed
    body,    ///< stiffness or mass
    load,
    holds,
    joins,
    rubs, ///< contact and friction
    turns,
    unknown
  };

  /// Returns the keywords that are known, each with its star and one blank between its words, and
  /// what they carry.
  const std::map<std::string, DeckMeaning> &deck_keywords();

  /// Returns what a keyword (deck_keyword()) carries, whether or not it is read.
  DeckMeaning deck_meaning(const std::string &keyword);

  /// Returns whether what the keyword says must not be left out in silence.
  bool counts(DeckMeaning meaning);

  /// Names the meaning in messages, as "carries load".
  std::string name_of(DeckMeaning meaning);

  /// Names the faces under a row of *DLOAD, as DLOAD_BACK_P2 for the faces P2 of BACK, a set or a
  /// number of elements. The mesh has a surface of this name.
  std::string deck_load_surface(const std::string &elements, const std::string &side);

  /// Returns the face S1 to S6 of a load P1 to P6 of *DLOAD; empty: another load.
  std::string deck_side_of_load(const std::string &label);
} // namespace squeal
