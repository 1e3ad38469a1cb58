#include <squeal/base/errors.h>
#include <squeal/base/files.h>
#include <squeal/base/memory.h>
#include <squeal/base/signals.h>
#include <squeal/base/text.h>
#include <squeal/run/advice.h>
#include <squeal/run/deck_window.h>
#include <squeal/run/driver.h>
#include <squeal/run/report.h>
#include <squeal/scenes/deck_parameters.h>
#include <squeal/studies/study_points.h>

#include <deal.II/base/config.h>
#include <deal.II/base/mpi.h>

#include <slepcsys.h>
#include <unistd.h>

#include <petscblaslapack.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <new>
#include <sstream>
#include <vector>

// Written at build time by scripts/revision.cmake; empty outside of git.
extern const char *const squeal_revision;
// Of OpenBLAS, if that is the BLAS in use.
extern "C" __attribute__((weak)) void openblas_set_num_threads(int);
extern "C" __attribute__((weak)) char *openblas_get_corename();
extern "C" __attribute__((weak)) void gotoblas_dynamic_quit();
extern "C" __attribute__((weak)) void gotoblas_dynamic_init();

namespace
{
  /// OpenBLAS would take a thread for every core, which wait for each other in the small products
  /// of a sparse factorisation: twice the processor time for no gain. Ranks are the better use of
  /// cores; who sets the number of threads gets them.
  void use_one_thread_unless_told()
  {
    if (openblas_set_num_threads && !std::getenv("OMP_NUM_THREADS") &&
        !std::getenv("OPENBLAS_NUM_THREADS"))
      openblas_set_num_threads(1);
  }

  /// OpenBLAS chooses its kernels by a list of processors. One that is younger than the library
  /// gets those of 2004 (SSE3), which need four times as long for dense products and a third more
  /// for a whole run. What the processor can do decides here, before anything is computed. Who sets
  /// OPENBLAS_CORETYPE gets what it says.
  void use_kernels_of_this_processor()
  {
    if (!openblas_get_corename || !gotoblas_dynamic_quit || !gotoblas_dynamic_init ||
        std::getenv("OPENBLAS_CORETYPE") || openblas_get_corename() != std::string("Prescott"))
      return;
#ifdef __x86_64__
    const bool has_avx512 =
                   __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
                   __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq"),
               has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    if (!has_avx2)
      return;
    setenv("OPENBLAS_CORETYPE", has_avx512 ? "SkylakeX" : "Haswell", 0);
    gotoblas_dynamic_quit();
    gotoblas_dynamic_init();
#endif
  }

  const char *out_of_memory =
      "out of memory. Results so far are kept. Use a coarser mesh or a machine with more memory.";

  /// Ends the process without the libraries' last words: they wait for threads that wait for
  /// memory.
  [[noreturn]] void end_without_memory()
  {
    std::cout.flush();
    std::_Exit(squeal::exit_other);
  }

  /// Ends the process where a limit of its address space leaves no room for what MPI, PETSc and
  /// OpenBLAS take before anything is computed. They do not say so: OpenBLAS tries for ever, and
  /// the other ranks would wait for this one.
  void need_memory_of_libraries()
  {
    constexpr double of_libraries_mib = 352; // a run of 300 unknowns takes 310 on two cores
    const double left                 = squeal::available_address_space_mib();
    if (left >= of_libraries_mib)
      return;
    std::cerr << "\nsqueal: out of memory: the limit of the address space (ulimit -v) leaves "
              << int(left) << " MiB; MPI, PETSc and OpenBLAS take " << of_libraries_mib << "."
              << std::endl;
    end_without_memory();
  }

  /// OpenBLAS takes its buffer in the first product that is large enough, and keeps it. Once it has
  /// one, it needs no more.
  void let_blas_take_its_buffer()
  {
    constexpr PetscBLASInt n = 192;
    const std::vector<double> a(n * n, 1.);
    std::vector<double> b(n * n);
    const double one = 1, zero = 0;
    BLASgemm_("N", "N", &n, &n, &n, &one, a.data(), &n, a.data(), &n, &zero, b.data(), &n);
  }

  /// Whether no mpirun or other launcher started this process.
  bool is_alone()
  {
    for (const char *name : {"OMPI_COMM_WORLD_SIZE", "PMIX_NAMESPACE", "PMIX_RANK", "PMI_RANK",
                             "PMI_FD", "SLURM_PROCID"})
      if (std::getenv(name))
        return false;
    return true;
  }

  /// Without mpirun or another launcher there is nobody to talk to: then Open MPI need not
  /// look for networks nor start a process beside this one, 0.3 s of waiting. Nor need it keep
  /// files in a directory for sessions: all such runs would share one, and the one that ends would
  /// take it from another that begins (3 of 400 runs failed, four at a time). Who sets these
  /// variables gets what they say; other MPI do not know them.
  void start_quickly_if_alone()
  {
    if (!is_alone())
      return;
    setenv("OMPI_MCA_ess_singleton_isolated", "1", 0);
    setenv("OMPI_MCA_orte_create_session_dirs", "0", 0);
    setenv("OMPI_MCA_pml", "ob1", 0);
    setenv("OMPI_MCA_btl", "self", 0);
  }

  const char *usage =
      "squeal " SQUEAL_VERSION ": predicts disc-brake squeal\n"
      "\n"
      "  squeal FILE.prm [--set \"Section/Key=value\"]... [--overwrite]\n"
      "                                                   run (in parallel: mpirun -np N squeal "
      "...)\n"
      "  squeal --check FILE.prm                          validate, print what would run\n"
      "  squeal --from-deck FILE.inp [--rotor NAME] [--speed RAD/S] [--partial] [--overwrite]\n"
      "                                                   write FILE.prm: what a deck of Abaqus or "
      "CalculiX says\n"
      "  squeal --print-parameters=prm|json|md            every key with default, unit, allowed "
      "values\n"
      "  squeal --help KEY                                the keys with that in their path: "
      "default, meaning, allowed values\n"
      "  squeal --version | --help\n"
      "\n"
      "--overwrite: the results of another run in the output directory, or FILE.prm, may be "
      "replaced.\n"
      "--rotor: the section of the deck that turns, where no name is like rotor or disc; none: "
      "parts are studied alone.\n"
      "--speed: how fast the rotor turns, where the deck does not say it. --partial: what of the "
      "deck cannot be read is left out, and listed.\n"
      "Open MPI refuses mpirun by root (containers): set OMPI_ALLOW_RUN_AS_ROOT=1 and\n"
      "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1, or use RANKS=N scripts/run.sh, which does.\n"
      "Exit status: 0 finished, 2 the input is wrong, 3 a solver failed, 1 anything else.\n";

  /// What was to be shown has not arrived: the disk is full, or what reads it has ended.
  struct OutputFailed : std::runtime_error
  {
    using std::runtime_error::runtime_error;
  };

  void finish_output(std::ostream &out, const std::string &kept = "")
  {
    if (!out.flush())
      throw OutputFailed("the standard output cannot be written." + kept);
  }

  struct CommandLine
  {
    bool check = false, help = false, version = false, overwrite = false;
    std::string print_format, filename, deck, key;
    squeal::DeckOptions of_deck;
    std::vector<std::string> overrides;
  };

  /// Refuses what does not go with --from-deck, and its options without it.
  void check_deck_options(const CommandLine &command)
  {
    using squeal::InputError;
    const squeal::DeckOptions &options = command.of_deck;
    if (command.deck.empty())
    {
      if (!options.rotor.empty() || options.speed || options.partial)
        throw InputError("--rotor, --speed and --partial go with --from-deck.");
      return;
    }
    const std::string other = !command.filename.empty()       ? command.filename
                              : !command.overrides.empty()    ? "--set"
                              : command.check                 ? "--check"
                              : !command.print_format.empty() ? "--print-parameters"
                                                              : "";
    if (!other.empty())
      throw InputError("--from-deck " + command.deck + ": " + other +
                       " does not go with it; allowed are --rotor NAME, --speed RAD/S, --partial, "
                       "--overwrite.");
  }

  CommandLine parse(const std::vector<std::string> &arguments)
  {
    using squeal::InputError;
    CommandLine result;
    const std::string print = "--print-parameters";
    for (std::size_t i = 0; i < arguments.size(); ++i)
    {
      const std::string &argument = arguments[i];
      if (argument == "--help" || argument == "-h")
      {
        result.help = true;
        if (i + 1 < arguments.size() && arguments[i + 1].rfind("-", 0) != 0)
          result.key = arguments[++i];
      }
      else if (argument == "--version")
        result.version = true;
      else if (argument == "--check")
        result.check = true;
      else if (argument == "--overwrite")
        result.overwrite = true;
      else if (argument == "--set")
      {
        if (++i == arguments.size())
          throw InputError("--set: expected \"Section/Key=value\" after it.");
        result.overrides.push_back(arguments[i]);
      }
      else if (argument == "--from-deck" || argument == "--rotor")
      {
        if (++i == arguments.size())
          throw InputError(argument + ": expected a name after it.");
        std::string &name = argument == "--rotor" ? result.of_deck.rotor : result.deck;
        if (!name.empty())
          throw InputError(argument + " is there twice; allowed is once.");
        name = arguments[i];
      }
      else if (argument == "--speed")
      {
        if (++i < arguments.size())
          result.of_deck.speed = squeal::decimal_number(arguments[i]);
        if (!result.of_deck.speed)
          throw InputError("--speed: expected a number after it, in rad/s.");
      }
      else if (argument == "--partial")
        result.of_deck.partial = true;
      else if (argument == print)
        result.print_format = "prm";
      else if (argument.rfind(print + "=", 0) == 0)
        result.print_format = argument.substr(print.size() + 1);
      else if (!argument.empty() && argument[0] == '-')
        throw InputError("Unknown option " + argument + ".\n\n" + usage);
      else if (!result.filename.empty())
        throw InputError("One parameter file is expected, not both " + result.filename + " and " +
                         argument + ".");
      else
        result.filename = argument;
    }
    check_deck_options(result);
    return result;
  }

  /// The program's version and the versions of the libraries that it runs with. The last digits of
  /// results depend on the kernels of the BLAS, too.
  std::string version()
  {
    char petsc[256], slepc[256], mpi[MPI_MAX_LIBRARY_VERSION_STRING];
    int length = 0;
    // None of these needs its library to be initialised.
    PetscGetVersion(petsc, sizeof(petsc));
    SlepcGetVersion(slepc, sizeof(slepc));
    MPI_Get_library_version(mpi, &length);
    // "SLEPc Release Version 3.18.2, Jan 27, 2023"
    const auto number = [](const std::string &text)
    {
      const std::size_t first = std::min(text.find_first_of("0123456789"), text.size());
      return text.substr(first, text.find(',', first) - first);
    };
    const std::string revision = squeal_revision, mpi_text(mpi, length);
    return "squeal " SQUEAL_VERSION + (revision.empty() ? "" : " (revision " + revision + ")") +
           "\n  deal.II " DEAL_II_PACKAGE_VERSION "\n  PETSc " + number(petsc) + "\n  SLEPc " +
           number(slepc) + "\n  " + mpi_text.substr(0, mpi_text.find_first_of(",\n")) + "\n" +
           (openblas_get_corename
                ? "  OpenBLAS with kernels for " + std::string(openblas_get_corename()) + "\n"
                : "");
  }

  /// Writes the parameter file of a deck beside it. Returns what to say, or nothing where modes are
  /// to be counted first, which MPI and PETSc are needed for.
  std::string write_parameters_of_deck(const CommandLine &command, const bool has_libraries)
  {
    const std::string name      = command.deck.substr(0, command.deck.rfind(".inp")) + ".prm";
    squeal::DeckParameters deck = squeal::parameters_of_deck(command.deck, command.of_deck);
    if (deck.n_modes > 0 && !has_libraries)
      return "";
    if (deck.n_modes > 0)
    {
      squeal::DeckOptions options = command.of_deck;
      options.window              = squeal::window_of_modes(name, deck.text, deck.n_modes);
      deck                        = squeal::parameters_of_deck(command.deck, options);
    }
    const std::string &text = deck.text;
    if (!command.overwrite && std::filesystem::exists(name))
      throw squeal::InputError("--from-deck: " + name +
                               " exists; with --overwrite it is replaced.");
    squeal::write_file(name, [&](std::ostream &out) { out << text; });
    const std::size_t list = text.find("# Passed over:");
    const std::string doubt =
        text.rfind("# Warning", 0) == 0 ? text.substr(2, text.find('\n') - 1) : "";
    return "Written: " + name + "\n" + doubt + (list == std::string::npos ? "" : text.substr(list));
  }

  /// The command, the time, the machine and the revision, for the log: what a page about the run
  /// tells, and what an author who finds an old directory wants to know.
  std::string how_called(const CommandLine &command)
  {
    const auto quoted = [](const std::string &word) {
      return word.find_first_of(" '\"*$&;<>()|") == std::string::npos ? word : "\"" + word + "\"";
    };
    std::string text = "Command: squeal " + quoted(command.filename);
    for (const std::string &override_text : command.overrides)
      text += " --set " + quoted(override_text);
    if (command.overwrite)
      text += " --overwrite";
    const std::time_t now = std::time(nullptr);
    char moment[40], host[256] = "";
    std::strftime(moment, sizeof(moment), "%Y-%m-%d %H:%M:%S UTC", std::gmtime(&now));
    gethostname(host, sizeof(host) - 1);
    const std::string revision = squeal_revision;
    return text + "\nStarted: " + moment + " on " + host +
           (revision.empty() ? "" : ", revision " + revision) + "\n";
  }

  /// Prints what needs neither MPI nor PETSc; false if @p command asks for something else.
  bool answer(const CommandLine &command, std::ostream &out, const bool has_libraries)
  {
    std::ostringstream text; // libraries dump their stack where they cannot write
    if (!command.key.empty())
      squeal::ParameterFile().print_keys(text, command.key);
    else if (command.help)
      text << usage;
    else if (command.version)
      text << version();
    else if (!command.deck.empty())
      text << write_parameters_of_deck(command, has_libraries);
    else if (!command.print_format.empty())
      squeal::ParameterFile().print_manual(text, command.print_format);
    else
      return false;
    if (text.str().empty())
      return false;
    out << text.str();
    finish_output(out);
    return true;
  }

  void run(const CommandLine &command, const MPI_Comm comm)
  {
    const bool speaks = dealii::Utilities::MPI::this_mpi_process(comm) == 0;
    std::ostringstream nowhere;
    std::ostream &out = speaks ? std::cout : nowhere;

    if (!command.deck.empty() && !speaks)
      return; // one rank writes
    if (answer(command, out, true))
      return;
    if (command.filename.empty())
      throw squeal::InputError(std::string("A parameter file is needed.\n\n") + usage);
    squeal::ParameterFile file;
    file.read(command.filename, command.overrides, comm);
    std::string directory = file.parameters().output.directory;
    if (directory.empty())
      directory = "output/" + std::filesystem::path(command.filename).stem().string();
    if (command.check)
    {
      const std::vector<std::string> doubts = squeal::check_study(file);
      out << command.filename << ": valid\n" << squeal::describe(file.parameters(), directory);
      for (const std::string &doubt : doubts)
        out << doubt << "\n";
    }
    else
      squeal::run(file, directory, comm, {command.overwrite, version(), how_called(command)});
    finish_output(out, command.check ? "" : " The results in " + directory + " are complete.");
  }

  /// A message for a terminal. What users wrote is quoted in it: it may be long, a line of a binary
  /// file, or hold control sequences. Beginning and end say what is wrong and what is allowed.
  std::string printable(std::string message)
  {
    constexpr std::size_t longest = 3000, end = 1200;
    if (message.size() > longest)
      message = message.substr(0, longest - end) + " [... " +
                std::to_string(message.size() - longest) + " characters ...] " +
                message.substr(message.size() - end);
    for (char &c : message)
      if (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t')
        c = '?';
    return message;
  }

  constexpr int tag_of_failure = 32000; // no other message goes out under it

  /// Whether rank 0 fails, too, and says why: asked by the others, for at most two seconds.
  bool first_rank_speaks(const MPI_Comm comm)
  {
    int heard = 0;
    for (unsigned int waited = 0; heard == 0 && waited < 200; ++waited)
    {
      MPI_Iprobe(0, tag_of_failure, comm, &heard, MPI_STATUS_IGNORE);
      usleep(10000);
    }
    return heard != 0;
  }

  /// One rank speaks. A rank that fails alone must not leave the others waiting: after a failure in
  /// parallel all are ended.
  int fail(const int status, const std::string &message, const MPI_Comm comm)
  {
    const unsigned int n_ranks = dealii::Utilities::MPI::n_mpi_processes(comm);
    const bool speaks          = dealii::Utilities::MPI::this_mpi_process(comm) == 0;
    // From here on a signal ends this rank: MPI_Abort of another one sends it.
    for (const int signal : {SIGINT, SIGTERM})
      std::signal(signal, SIG_DFL);
    if (speaks)
      for (unsigned int rank = 1; rank < n_ranks; ++rank)
      {
        MPI_Request request;
        MPI_Isend(nullptr, 0, MPI_BYTE, rank, tag_of_failure, comm, &request);
      }
    else if (first_rank_speaks(comm))
      sleep(60); // it ends this rank
    std::cerr << (speaks ? "" : "\n") << "\nsqueal: " << printable(message) << std::endl;
    if (n_ranks > 1)
      MPI_Abort(comm, status);
    return status;
  }
} // namespace

int main(int argc, char *argv[])
{
  need_memory_of_libraries();
  use_kernels_of_this_processor();
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  // Questions need not wait for MPI and PETSc. What is wrong with the arguments is said below.
  CommandLine command;
  std::string objection;
  try
  {
    command = parse(arguments);
    if (is_alone() && answer(command, std::cout, false))
      return squeal::exit_finished;
  }
  catch (const squeal::InputError &error)
  {
    objection = error.what();
  }
  catch (const OutputFailed &error)
  {
    std::cerr << "\nsqueal: " << error.what() << std::endl;
    return squeal::exit_other;
  }
  // PETSc would take --help and the like for its own options, so it sees only the program's name.
  int n_visible     = 1;
  char **visible    = argv;
  char *only_name[] = {argv[0], nullptr};
  visible           = only_name;
  start_quickly_if_alone();
  dealii::Utilities::MPI::MPI_InitFinalize mpi(n_visible, visible, 1);
  PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);
  dealii::deal_II_exceptions::disable_abort_on_exception();

  squeal::end_cleanly_on_signals();
  use_one_thread_unless_told();
  let_blas_take_its_buffer();

  const MPI_Comm comm = MPI_COMM_WORLD;
  try
  {
    if (!objection.empty())
      throw squeal::InputError(objection);
    run(command, comm);
  }
  catch (const squeal::InputError &error)
  {
    return fail(squeal::exit_bad_input, error.what(), comm);
  }
  catch (const squeal::SolverError &error)
  {
    return fail(squeal::exit_solver_error, error.what() + squeal::advice(error), comm);
  }
  catch (const squeal::Interrupted &signal)
  {
    return fail(squeal::exit_other,
                std::string("ended by ") + signal.what() +
                    ". Results so far are kept; a refinement, sweep or map goes on when it is "
                    "started again with the same parameters.",
                comm);
  }
  catch (const std::bad_alloc &)
  {
    fail(squeal::exit_other, out_of_memory, comm);
    end_without_memory();
  }
  catch (const std::exception &error)
  {
    return fail(squeal::exit_other, error.what(), comm);
  }
  return squeal::exit_finished;
}
