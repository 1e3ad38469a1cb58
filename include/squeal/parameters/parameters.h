#pragma once

#include <squeal/parameters/choices.h>
#include <squeal/parameters/friction_laws.h>
#include <squeal/parameters/materials.h>

#include <array>
#include <complex>
#include <string>
#include <utility>
#include <vector>

// The parameters of a run: one struct per section of the parameter file, in its order, and at the
// end Parameters::All with the rules across sections. Defaults are the member initialisers,
// declare() makes the members keys, every text carries its unit, and check() holds the rules that
// no pattern of a single key can express: it throws InputError with the path of the key. Rooms
// behind scenes, model, studies and run take a section or a value.

namespace squeal
{
  /// What a stage brings into the equations of motion.
  struct StageTerms
  {
    bool transport        = false; ///< 2 Omega G and -Omega^2 M*
    bool friction         = false; ///< mu T
    bool friction_damping = false; ///< P_R, Q_R
    bool material_damping = false; ///< D
  };
  StageTerms terms_of(Stage stage);

  namespace Parameters
  {
    /// The keys of a StiffnessFactor.
    void declare(dealii::ParameterHandler &prm, StiffnessFactor &factor);
    void check(const std::string &section, const StiffnessFactor &factor);

    struct MaterialSection : Material
    {
      explicit MaterialSection(const Material &defaults) : Material(defaults) {}
      std::string modulus_table = ""; ///< file
      void declare(dealii::ParameterHandler &prm);
      void check(const std::string &section) const;
    };

    struct Rotor
    {
      double inner_radius = 0.05;
      double outer_radius = 0.15;
      double thickness    = 0.012;
      Clamped clamped     = Clamped::inner;
      Transport transport = Transport::full;
      MaterialSection material{Material{1.25e11, 0.25, 7200, 0, 1e-7}};

      void declare(dealii::ParameterHandler &prm);
      void check() const;
    };

    struct Pads
    {
      Arrangement arrangement = Arrangement::both;
      double inner_radius     = 0.09;
      double outer_radius     = 0.14;
      double sector_angle     = 50;
      double thickness        = 0.012;
      BackFace back_face      = BackFace::guided;
      double pressure         = 1e6;
      std::string profile     = "1";
      MaterialSection material{Material{1e10, 0.3, 2500, 0, 2e-6}};

      bool upper() const
      {
        return arrangement != Arrangement::none;
      }
      bool lower() const
      {
        return arrangement == Arrangement::both;
      }
      int n_pads() const
      {
        return int(upper()) + int(lower());
      }

      void declare(dealii::ParameterHandler &prm);
      void check(const Rotor &rotor) const;
    };

    struct Operation
    {
      double angular_velocity     = 20;
      Direction direction_at_rest = Direction::forward;
      double temperature          = 20; ///< deg C, of tables of moduli

      /// Omega with the sign of the direction, which -0 has, too.
      double directed_velocity() const
      {
        return angular_velocity == 0 && direction_at_rest == Direction::backward ? -0.
                                                                                 : angular_velocity;
      }
      void declare(dealii::ParameterHandler &prm);
    };

    /// Damping of the real modes by measured ratios.
    struct ModalDamping
    {
      struct Ratio
      {
        double frequency; ///< Hz
        double value;     ///< of critical damping, -
      };
      std::vector<Ratio> ratios; ///< by ascending frequency; empty: none
      double factor = 1;         ///< of all ratios, -

      bool is_active() const
      {
        return !ratios.empty() && factor != 0;
      }
      /// The ratio at a frequency, Hz: linear between those given, constant beyond.
      double at(double frequency) const;
      /// d(w zeta)/dw there, -.
      double slope(double frequency) const;
      void declare(dealii::ParameterHandler &prm);
      void check() const;
    };

    /// How pads wear: dh/dt = k p^alpha v^beta (theory.md, section 3).
    struct Wear
    {
      double coefficient       = 1e-14; ///< k; m^2/N for Archard's law
      double pressure_exponent = 1, speed_exponent = 1;
      std::string sliding_distance = "infinite"; ///< m
      double pressure              = 0;          ///< Pa, of bedding; 0: Pads/Pressure

      /// m, at the mean radius of the contact; infinite: worn until nothing changes any more.
      /// Throws InputError.
      double distance() const;
      void declare(dealii::ParameterHandler &prm);
    };

    struct Contact
    {
      Formulation formulation        = Formulation::mortar;
      double penalty_stiffness       = 1e12;
      double normal_dashpot          = 0; ///< N s/m^3
      double tangential_dashpot      = 0; ///< N s/m^3
      SteadyPressure steady_pressure = SteadyPressure::computed;
      FrictionLaw friction{FrictionLaw::Kind::constant, 0.6, 0.3, 1, 0, "", {}};
      std::string friction_of_pads = ""; ///< "pad : key value; key value, pad : ..."
      std::string initial_gap      = "0";
      bool self_locking_check      = false;
      Wear wear;

      /// Whether the static equilibrium gives the steady pressure, or that is known without it.
      bool computes_pressure() const
      {
        return steady_pressure == SteadyPressure::computed || (is_worn() && !is_fully_worn());
      }
      bool is_worn() const
      {
        return steady_pressure == SteadyPressure::worn;
      }
      bool is_fully_worn() const;
      /// Whether the pressure is a multiplier, with or without compliance.
      bool mortar() const
      {
        return formulation != Formulation::penalty;
      }
      /// 1/k_C where it acts on the multiplier, m^3/N.
      double compliance() const
      {
        return formulation == Formulation::mortar_penalty ? 1 / penalty_stiffness : 0;
      }

      /// The laws of pads that have their own, by name: the section Friction with what is given
      /// for the pad in its place. Throws InputError.
      std::vector<std::pair<std::string, FrictionLaw>> friction_by_pad() const;
      /// Whether friction of all pads passes through zero with the speed.
      bool is_smoothed() const;

      void declare(dealii::ParameterHandler &prm);
      void check(Stage stage, double angular_velocity);
    };

    /// The two-dimensional scene: an elastic layer, periodic in x, under a block. Materials,
    /// pressure and support of the block are those of the sections Rotor and Pads.
    struct Strip
    {
      double length          = 0.2;
      double thickness       = 0.02;
      double block_length    = 0.05;
      double block_thickness = 0.02;

      void declare(dealii::ParameterHandler &prm);
      void check() const;
    };

    /// Volumes of a mesh file that have a material of their own.
    struct MeshPart
    {
      std::string volumes = "";
      PartOf body         = PartOf::pads;
      MaterialSection material{Material{2.1e11, 0.3, 7850, 0, 1e-7}};

      void declare(dealii::ParameterHandler &prm);
    };

    /// Pairs of names out of "a : b, c : d". @p wanted names the two, as "pad surface : rotor
    /// surface". Throws InputError with @p key.
    std::vector<std::pair<std::string, std::string>>
    pairs_of_names(const std::string &key, const std::string &text, const std::string &wanted);

    /// The scene of a mesh file: what its groups are.
    struct Mesh
    {
      std::string file = "", origin_text = "0, 0, 0";
      Axis axis                = Axis::z;
      CurvedBodies curved      = CurvedBodies::rotor;
      DividedElements divided  = DividedElements::own;
      OtherVolumes others      = OtherVolumes::refused;
      double scale             = 1;
      unsigned int refinements = 0;
      double contact_tolerance = 0; ///< m; 0: a part of the pad's size
      std::string rotor = "rotor", pads = "", contact_pairs = "", pressure_on = "", pressures = "";
      std::string clamped = "", guided = "";
      std::array<std::string, 3> fixed = {{"", "", ""}};
      std::vector<MeshPart> parts      = std::vector<MeshPart>(4); ///< Part 1, Part 2, ...
      /// Surfaces with pressures of their own, Pa: the list Pressures, which check() reads.
      std::vector<std::pair<std::string, double>> surface_pressures = {};
      /// Begins the path by which studies vary the pressure of one surface.
      static constexpr const char *pressure_path = "Mesh/Pressures/";
      /// Returns the list Pressures with another value on one surface. Throws InputError if it is
      /// not there.
      std::string pressures_with(const std::string &surface, double value,
                                 const std::string &where) const;
      /// Returns whether any load of the section is not zero.
      bool is_loaded(double pads_pressure) const;

      /// Surfaces of pad and rotor that touch. Throws InputError.
      std::vector<std::pair<std::string, std::string>> pairs() const;
      /// In units of the file. Throws InputError.
      std::array<double, 3> origin() const;
      void declare(dealii::ParameterHandler &prm);
      /// Reads lists, too. Throws InputError.
      void check();
    };

    /// How bodies of a mesh file hang together where their meshes do not (theory.md, section 11).
    struct Joints
    {
      std::string ties = "", contacts = "", points = "", masses = "", springs = "", dashpots = "",
                  links         = "";
      std::string superelements = "";
      double position_tolerance = 0; ///< m; 0: a part of the faces' size

      bool active() const
      {
        return !ties.empty() || !contacts.empty() || !points.empty() || !superelements.empty();
      }

      /// Surfaces that are tied; the first of a pair has the multipliers. Throws InputError.
      std::vector<std::pair<std::string, std::string>> tied_surfaces() const;

      struct Contact
      {
        std::string first, second; ///< surfaces; the first has the multipliers
        bool sticks;
        double friction; ///< up to which it sticks, or zero: not known
      };
      struct Point
      {
        std::string name, surface;        ///< no surface: a point in space
        std::array<double, 3> place = {}; ///< m, without a surface
      };
      /// Six numbers: along and about x, y, z.
      using Six                           = std::array<double, 6>;
      static constexpr const char *ground = "ground";
      struct Mass
      {
        std::string point;
        Six values; ///< m, m, m (kg) and moments of inertia, kg m^2
      };
      /// A spring (N/m, N m), a dashpot (N s/m, N m s) or a rigid link (no values).
      struct Connection
      {
        std::string first, second; ///< points; the second may be the ground
        Six values = {};
        /// Unit vectors to which the values of a spring or dashpot belong.
        std::array<std::array<double, 3>, 3> axes = {{{{1, 0, 0}}, {{0, 1, 0}}, {{0, 0, 1}}}};
      };
      /// Matrices of another program or run: <files>-K.mtx and so on, held to surfaces.
      struct Superelement
      {
        std::string name, files;
        std::vector<std::string> surfaces;
      };
      // Throw InputError.
      std::vector<Contact> list_of_contacts() const;
      std::vector<Point> list_of_points() const;
      bool has_point(const std::string &name) const;
      std::vector<Mass> list_of_masses() const;
      std::vector<Connection> list_of_springs() const;
      std::vector<Connection> list_of_dashpots() const;
      std::vector<Connection> list_of_links() const;
      std::vector<Superelement> list_of_superelements() const;

      void declare(dealii::ParameterHandler &prm);
      void check() const;
    };

    struct Discretization
    {
      unsigned int degree                     = 3;
      std::array<unsigned int, 3> rotor_cells = {{5, 36, 1}};
      std::array<unsigned int, 3> pad_cells   = {{3, 6, 1}};
      bool align_rotor                        = true;
      unsigned int clamp_layers               = 1;
      unsigned int pad_edge_layers            = 0;
      double layer_ratio                      = 0.2;
      std::string rotor_cells_text            = "5, 36, 1";
      std::string pad_cells_text              = "3, 6, 1";

      void declare(dealii::ParameterHandler &prm);
      void check();
    };

    struct Refinement
    {
      Strategy strategy             = Strategy::none;
      unsigned int cycles           = 1;
      unsigned int edge_levels      = 0;
      double tolerance              = 1e-3;
      unsigned int maximum_unknowns = 500000;
      double maximum_time           = 0;
      double maximum_memory         = 0;
      bool check_memory             = true;
      std::string reference         = "";

      /// The number of meshes a run may use.
      unsigned int n_cycles() const
      {
        return strategy == Strategy::none ? 1 : cycles;
      }
      /// The eigenvalues of the file @p reference; none if there is no file. Throws InputError.
      std::vector<std::complex<double>> reference_eigenvalues() const;
      void declare(dealii::ParameterHandler &prm);
      void check() const;
    };

    struct StaticEquilibrium
    {
      LinearSolver linear_solver      = LinearSolver::automatic;
      Multigrid multigrid             = Multigrid::gamg;
      unsigned int maximum_iterations = 300;

      void declare(dealii::ParameterHandler &prm);
    };

    struct Eigenproblem
    {
      double minimum_frequency = 0;
      double maximum_frequency = 6000;
      ModeSolver solver        = ModeSolver::block_krylov;
      double tolerance         = 1e-9;
      double shift             = 0;
      bool error_bars          = true;
      bool mirror_symmetry     = true;

      /// Whether modes are wanted, or the static equilibrium only.
      bool is_solved() const
      {
        return solver != ModeSolver::none;
      }
      /// Whether they are found without factors and without the bodies' matrices.
      bool is_matrix_free() const
      {
        return solver == ModeSolver::block_davidson;
      }
      void declare(dealii::ParameterHandler &prm);
      void check() const;
    };

    /// Terms of the size of the static stress, off by default.
    struct Prestress
    {
      bool centrifugal_load = false;
      bool stress_stiffness = false;
      bool turning_contact  = false;

      /// Whether the displacements of the static equilibrium are needed.
      bool needs_state() const
      {
        return centrifugal_load || stress_stiffness;
      }
      void declare(dealii::ParameterHandler &prm);
    };

    struct Sweep
    {
      static constexpr const char *nothing = "none"; ///< in place of the path of a key

      std::string parameter        = nothing;
      std::string values           = "";
      std::string second_parameter = nothing;
      std::string second_values    = "";
      bool critical_values         = false;

      bool active() const
      {
        return parameter != nothing;
      }
      /// Whether two parameters span a stability map.
      bool is_map() const
      {
        return second_parameter != nothing;
      }
      /// Whether the mesh stays as it is when a parameter changes.
      static bool keeps_mesh(const std::string &parameter);
      /// Throws InputError unless it does; @p where names the key, @p what keeps the mesh.
      static void need_mesh_kept(const std::string &parameter, const std::string &where,
                                 const std::string &what);
      /// The values, ascending or descending as given. Throw InputError.
      std::vector<double> points() const;
      std::vector<double> second_points() const;
      void declare(dealii::ParameterHandler &prm);
      void check() const;
    };

    /// Uncertain numbers, and samples of them.
    struct Sampling
    {
      /// The distribution of a number, independent of the others but for Sampling/Correlation.
      struct Distribution
      {
        enum class Kind
        {
          uniform,
          normal,
          lognormal,
          table
        };
        std::string parameter; ///< the path of its key
        Kind kind = Kind::uniform;
        /// Bounds; mean and standard deviation; median and standard deviation of the logarithm;
        /// values at which the probability of a smaller one is as in probabilities.
        std::vector<double> numbers, probabilities;

        /// The value that is not exceeded with this probability, in (0, 1).
        double quantile(double probability) const;
      };

      std::string parameters   = "";
      unsigned int samples     = 1024;
      std::string correlation  = "";
      bool sensitivity_indices = false;
      std::string file         = "";

      bool active() const
      {
        return !parameters.empty() || !file.empty();
      }
      /// In the order of the key. Throws InputError.
      std::vector<Distribution> distributions() const;
      /// L of the correlation matrix L L^T, row by row; the unit matrix if none is given. Throws
      /// InputError.
      std::vector<std::vector<double>> correlation_factor() const;
      void declare(dealii::ParameterHandler &prm);
      void check() const;
    };
    inline std::array<std::string, 4> names_of(Sampling::Distribution::Kind)
    {
      return {{"uniform", "normal", "lognormal", "table"}};
    }

    /// The harmonic forces whose response is wanted.
    struct Response
    {
      /// A point or a surface, and a force there or the direction of what is observed.
      struct Place
      {
        std::string text; ///< as the key says it
        /// A surface or a point of Joints/Points. With a point: the body that is meant, where
        /// several have it, or empty.
        std::string name;
        std::vector<double> point; ///< m; empty: the place is named
        std::vector<double> direction;
      };

      std::string forces       = "";
      std::string observations = "";
      std::string frequencies  = "";
      ResponseMethod method    = ResponseMethod::modal;
      double tolerance         = 1e-4;

      bool active() const
      {
        return !forces.empty();
      }
      /// Forces in N; unit directions of observations. Throw InputError.
      std::vector<Place> list_of_forces(unsigned int n_components) const;
      std::vector<Place> list_of_observations(unsigned int n_components) const;
      /// Hz, ascending. Throws InputError.
      std::vector<double> list_of_frequencies(double maximum) const;
      void declare(dealii::ParameterHandler &prm);
      void check(const Eigenproblem &eigenproblem, unsigned int n_components) const;
    };

    struct Matrices
    {
      std::string mass, velocity, stiffness, circulatory;
      double circulatory_factor = 1;
      double velocity_factor    = 1;

      /// f(l) c A, a stiffness that depends on how fast it is strained.
      struct Viscoelastic
      {
        std::string stiffness; ///< file of A; empty: there is none
        double factor = 1;     ///< c
        StiffnessFactor stiffness_factor;
      };
      std::array<Viscoelastic, 4> viscoelastic;

      void declare(dealii::ParameterHandler &prm);
      void check() const;
    };

    struct Output
    {
      std::string directory           = "";
      FieldOutput fields              = FieldOutput::unstable;
      unsigned int animation_frames   = 16;
      bool sensitivities              = false;
      bool matrices                   = false;
      std::string superelement        = ""; ///< body : surface : ...
      unsigned int superelement_modes = 20;
      double superelement_frequency   = 0; ///< Hz; 0: no limit
      /// The body of which a superelement is made, and the surfaces on which it hangs. Throws
      /// InputError.
      std::pair<std::string, std::vector<std::string>> superelement_of() const;
      void declare(dealii::ParameterHandler &prm);
    };

    /// A material of the scene, the section of its keys, and in the scene mesh the volumes that
    /// are made of it.
    struct BodyMaterial
    {
      std::string section;
      bool of_rotor;
      MaterialSection material;
      std::string volumes;
    };

    /// Everything a run needs to know.
    struct All
    {
      Scene scene = Scene::brake;
      Stage stage = Stage::full;
      Rotor rotor;
      Pads pads;
      Strip strip;
      Mesh mesh;
      Joints joints;
      Operation operation;
      ModalDamping modal_damping;
      Contact contact;
      Discretization discretization;
      Refinement refinement;
      StaticEquilibrium static_equilibrium;
      Eigenproblem eigenproblem;
      Prestress prestress;
      Sweep sweep;
      Sampling sampling;
      Response response;
      Matrices matrices;
      Output output;

      /// The number of components of a displacement: 2 in the strip, else 3.
      unsigned int n_components() const
      {
        return scene == Scene::strip ? 2 : 3;
      }
      StageTerms terms() const
      {
        StageTerms terms = terms_of(stage);
        terms.transport  = terms.transport && rotor.transport == Transport::full;
        return terms;
      }
      /// Whether the rotor turns, with or without transport terms.
      bool turns() const
      {
        return terms_of(stage).transport;
      }
      /// The materials of the scene: the rotor's, the pads', those of the parts of a mesh file.
      std::vector<BodyMaterial> materials() const;
      /// The material of a section, "Rotor", "Pads", "Mesh/Part 1" and so on.
      MaterialSection &material(const std::string &section);
      /// Throws InputError where Contact/Friction/Of pads names a pad that there is not.
      void check_friction_of_pads() const;
      /// Whether surfaces touch: pads on the rotor, or bodies that do not slide.
      bool has_contact() const
      {
        return n_pads() > 0 || !joints.contacts.empty();
      }
      /// The number of contact pairs.
      int n_pads() const
      {
        return scene == Scene::mesh    ? int(mesh.pairs().size())
               : scene == Scene::strip ? int(pads.upper())
                                       : pads.n_pads();
      }

      /// Whether a stiffness depends on how fast it is strained, or modes have measured damping:
      /// what a quadratic eigenproblem of sparse matrices does not hold.
      bool has_relaxation() const;
      /// Whether parameters vary: a sweep, a map or samples.
      bool varies_parameters() const
      {
        return sweep.active() || sampling.active();
      }
      /// Whether the stage, or one of the ladder's, has the damping of materials.
      bool has_damping() const
      {
        return stage == Stage::full || stage == Stage::ladder;
      }
      /// Whether the body is in the scene.
      bool is_used(const BodyMaterial &body) const;

      /// Makes every member an entry of @p prm; parsing @p prm then fills the members.
      void declare(dealii::ParameterHandler &prm);

      /// The rules across keys. Throws InputError.
      void check();

    private:
      void check_matrix_free() const;
      void check_export() const;
      void check_response() const;
      void check_edge_levels() const;
      void check_joints() const;
      void check_wear() const;
      void check_relaxation() const;
      /// Fits the factor of each material to its table (StiffnessFactor::fit) in the stage full.
      void fit_modulus_tables();
    };
  } // namespace Parameters
} // namespace squeal
