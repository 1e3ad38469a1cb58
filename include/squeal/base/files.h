#pragma once

#include <mpi.h>

#include <fstream>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

namespace squeal
{
  /// Writes a file that is complete or, if the run or the machine ends meanwhile, as it was before:
  /// under the name with ".part" first, and onto the disk before it is renamed. Throws
  /// std::runtime_error, with the system's reason, if that fails.
  void write_file(const std::string &filename, const std::function<void(std::ostream &)> &write);

  /// Adds to the end of a file: all of the text, or nothing if the disk is full. Throws as
  /// write_file().
  void append_to_file(const std::string &filename, const std::string &text);

  /// Rank 0 writes a whole file.
  void write_text(const std::string &filename, const std::string &text, MPI_Comm comm);

  /// Writes a file of text that the ranks have in pieces: those of rank 0 first, then those of the
  /// next one. @p next_piece gives one after the other, an empty one at the end. Rank 0 takes all
  /// pieces, and throws as write_file(). Collective.
  void write_in_pieces(const std::string &filename, const std::function<std::string()> &next_piece,
                       MPI_Comm comm);

  /// Waits until the content of a file, or the names in a directory, are on the disk. What does not
  /// exist is passed over. Throws as write_file().
  void sync_to_disk(const std::string &filename);

  /// The content of a file. Throws std::runtime_error, with the system's reason, if it cannot be
  /// read, is not a regular file (a pipe would wait for ever), or has more than @p most_bytes.
  std::string read_whole_file(const std::string &filename, std::size_t most_bytes);

  /// Reads a regular file as read_whole_file() does, and a pipe or a terminal until it ends. Throws
  /// also where nobody writes into a pipe for some seconds.
  std::string read_whole_file_or_pipe(const std::string &filename, std::size_t most_bytes);

  /// What editors put in front of a text in UTF-8; it is no part of the text.
  inline const std::string byte_order_mark = "\xEF\xBB\xBF";

  /// Opens a text file for reading, behind a byte order mark: not open if it is not there, cannot
  /// be read, or is no regular file (a pipe would wait for ever).
  std::ifstream open_regular_file(const std::string &filename);

  /// Makes a directory, if there is none; its parent is there. Throws std::runtime_error with the
  /// system's reason.
  void make_directory(const std::string &name);

  /// Hears of each file before this process creates it (write_file, append_to_file,
  /// announce_files): the manifest of the run. One at a time; an empty function ends it.
  using FileObserver = std::function<void(const std::vector<std::string> &filenames)>;
  void set_file_observer(FileObserver observer);
  /// Tells the observer of this process about files that other processes, or libraries, create.
  void announce_files(const std::vector<std::string> &filenames);
} // namespace squeal
