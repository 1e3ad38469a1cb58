#pragma once

#include <optional>
#include <string>

namespace squeal
{
  /// What is said beside a deck.
  struct DeckOptions
  {
    /// The volume group that turns; empty: the one with a name like rotor or disc; none: parts are
    /// studied alone.
    std::string rotor;
    std::optional<double> speed; ///< rad/s, where the deck does not tell it
    double window = 0;           ///< Hz, where the deck asks for a number of modes only
    bool partial  = false;       ///< what cannot be read is left out, and listed
  };

  struct DeckParameters
  {
    std::string text;         ///< of the parameter file
    unsigned int n_modes = 0; ///< that are asked for, where no frequency is
  };

  /// Writes what a deck of Abaqus or CalculiX says beside its mesh as a commented parameter file:
  /// materials and sections, ties, contact, friction, supports, pressure, springs, dashpots,
  /// masses. The file has been read back, with its mesh. What was passed over is listed at its end,
  /// by line. Throws InputError, also for what carries load, holds or joins and cannot be read.
  DeckParameters parameters_of_deck(const std::string &filename, const DeckOptions &options);
} // namespace squeal
