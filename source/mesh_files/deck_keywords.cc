#include <squeal/base/names.h>
#include <squeal/mesh_files/deck_keywords.h>

namespace squeal
{
  namespace
  {
    /// Keywords by what they carry, without the star, separated by commas.
    const std::map<DeckMeaning, const char *> keywords = {
        {DeckMeaning::silent,
         "HEADING, NODE, ELEMENT, NSET, ELSET, SURFACE, PART, END PART, ASSEMBLY, END ASSEMBLY, "
         "INSTANCE, END INSTANCE, INCLUDE, STEP, END STEP, PREPRINT, OUTPUT, NODE OUTPUT, EL FILE, "
         "ELEMENT OUTPUT, NODE FILE, CONTACT OUTPUT, ENERGY OUTPUT, NODE PRINT, EL PRINT, "
         "CONTACT FILE, CONTACT PRINT, RESTART, MONITOR, SYSTEM, FILE FORMAT, SECTION PRINT, "
         "FACE PRINT, TIME POINTS, MATERIAL, DISTRIBUTING, SURFACE INTERACTION, PRINT, "
         "ENERGY FILE, ENERGY PRINT, SECTION FILE, MODAL FILE, MODAL OUTPUT, MODAL PRINT, FILTER, "
         "INTEGRATED OUTPUT, INTEGRATED OUTPUT SECTION, RADIATION FILE, PARAMETER, SECTION POINTS, "
         "INCREMENTATION OUTPUT, DISTRIBUTION, DISTRIBUTION TABLE"},
        {DeckMeaning::nothing,
         "STATIC, FREQUENCY, COMPLEX FREQUENCY, STEADY STATE DYNAMICS, MODAL DYNAMIC, DYNAMIC, "
         "BUCKLE, GREEN, VISCO, HEAT TRANSFER, NO ANALYSIS, CONTROLS, SOLUTION TECHNIQUE, SOLVER, "
         "COUPLED TEMPERATURE-DISPLACEMENT, UNCOUPLED TEMPERATURE-DISPLACEMENT, SENSITIVITY, "
         "CONTACT CONTROLS, CONDUCTIVITY, SPECIFIC HEAT, EXPANSION, PLASTIC, CYCLIC HARDENING, "
         "CREEP, AMPLITUDE, PHYSICAL CONSTANTS, MODAL DAMPING, SURFACE SECTION, GAP CONDUCTANCE, "
         "GAP HEAT GENERATION, GAP RADIATION, HOURGLASS STIFFNESS, SECTION CONTROLS, DEPVAR, "
         "GLOBAL DAMPING, FILM, RADIATE, CFLUX, DFLUX, FILM PROPERTY, DFLOW, NODAL THICKNESS, "
         "LATENT HEAT, ELECTRICAL CONDUCTIVITY, EXTREME VALUE, FIXED MASS SCALING, "
         "VARIABLE MASS SCALING, BULK VISCOSITY, DIAGNOSTICS, CONTACT INITIALIZATION DATA, "
         "CONTACT INITIALIZATION ASSIGNMENT, CONTACT FORMULATION, CONTACT DAMPING, FIELD, "
         "FAIL STRAIN, FAIL STRESS, DAMAGE INITIATION, DAMAGE EVOLUTION, RATE DEPENDENT, "
         "ANNEAL TEMPERATURE, INELASTIC HEAT FRACTION, SURFACE PROPERTY ASSIGNMENT, "
         "SELECT EIGENMODES, BASE MOTION, DESIGN VARIABLES, OBJECTIVE, CONSTRAINT, FILE OUTPUT, "
         "DESIGN RESPONSE, FEASIBLE DIRECTION"},
        {DeckMeaning::body,
         "SOLID SECTION, SHELL SECTION, SHELL GENERAL SECTION, MEMBRANE SECTION, BEAM SECTION, "
         "BEAM GENERAL SECTION, COHESIVE SECTION, GASKET SECTION, ELASTIC, DENSITY, DAMPING, "
         "ORIENTATION, MASS, ROTARY INERTIA, NONSTRUCTURAL MASS, HYPERELASTIC, HYPERFOAM, "
         "VISCOELASTIC, USER MATERIAL, USER ELEMENT, MATRIX INPUT, MATRIX ASSEMBLE, "
         "CHANGE MATERIAL, CHANGE SOLID SECTION, CHANGE PLASTIC, SUBSTRUCTURE PROPERTY, UEL "
         "PROPERTY, MODEL CHANGE, DEFORMATION PLASTICITY, FLUID SECTION, REBAR, REBAR LAYER, "
         "ACOUSTIC MEDIUM, SUBMODEL, IMPERFECTION, IMPORT, MAP SOLUTION"},
        {DeckMeaning::load,
         "DLOAD, DSLOAD, CLOAD, TEMPERATURE, INERTIA RELIEF, INITIAL CONDITIONS, "
         "PRE-TENSION SECTION, CONNECTOR LOAD, CONNECTOR MOTION, FLUID CAVITY, FLUID BEHAVIOR, "
         "FLUID FLUX, PRESSURE PENETRATION, PRESSURE STRESS, FOUNDATION, CONTACT INTERFERENCE, "
         "CLEARANCE, PRESTRESS HOLD, PHYSICAL FIELD, LOAD CASE, SUBSTRUCTURE LOAD CASE, SLOAD, "
         "INCIDENT WAVE"},
        {DeckMeaning::holds, "BOUNDARY, TRANSFORM, BASE, SECONDARY BASE"},
        {DeckMeaning::joins,
         "TIE, COUPLING, KINEMATIC, KINEMATIC COUPLING, DISTRIBUTING COUPLING, MPC, RIGID BODY, "
         "EQUATION, MULTIPOINT CONSTRAINT, EMBEDDED ELEMENT, SHELL TO SOLID COUPLING, FASTENER, "
         "FASTENER PROPERTY, CONNECTOR SECTION, CONNECTOR BEHAVIOR, CONNECTOR ELASTICITY, "
         "CONNECTOR DAMPING, CONNECTOR CONSTITUTIVE REFERENCE, SPRING, DASHPOT, JOINT, RELEASE, "
         "CYCLIC SYMMETRY MODEL, SELECT CYCLIC SYMMETRY MODES, SYMMETRIC MODEL GENERATION, "
         "SUBSTRUCTURE PATH, CROSS MEMBER, RIGID SURFACE, TIED, CAP, NCOPY"},
        {DeckMeaning::rubs,
         "CONTACT PAIR, CONTACT, CONTACT INCLUSIONS, CONTACT EXCLUSIONS, FRICTION, GAP, "
         "CONTACT PROPERTY ASSIGNMENT, SURFACE BEHAVIOR, CHANGE FRICTION, CHANGE CONTACT TYPE, "
         "CHANGE SURFACE BEHAVIOR, COHESIVE BEHAVIOR, CONTACT STABILIZATION"},
        {DeckMeaning::turns, "MOTION, TRANSPORT VELOCITY, SYMMETRIC RESULTS TRANSFER"}};
  } // namespace

  const std::map<std::string, DeckMeaning> &deck_keywords()
  {
    static const std::map<std::string, DeckMeaning> meanings = []
    {
      std::map<std::string, DeckMeaning> result;
      for (const auto &[meaning, list] : keywords)
        for (const std::string &name : split_names(list))
          result["*" + name] = meaning;
      return result;
    }();
    return meanings;
  }

  DeckMeaning deck_meaning(const std::string &keyword)
  {
    const auto found = deck_keywords().find(keyword);
    return found == deck_keywords().end() ? DeckMeaning::unknown : found->second;
  }

  bool counts(const DeckMeaning meaning)
  {
    return meaning != DeckMeaning::silent && meaning != DeckMeaning::nothing;
  }

  std::string name_of(const DeckMeaning meaning)
  {
    static const std::map<DeckMeaning, std::string> names = {
        {DeckMeaning::body, "is stiffness or mass"},
        {DeckMeaning::load, "carries load"},
        {DeckMeaning::holds, "holds"},
        {DeckMeaning::joins, "joins"},
        {DeckMeaning::rubs, "is contact or friction"},
        {DeckMeaning::turns, "turns"},
        {DeckMeaning::unknown, "is not known"}};
    const auto name = names.find(meaning);
    return name == names.end() ? "carries nothing" : name->second;
  }

  std::string deck_load_surface(const std::string &elements, const std::string &side)
  {
    return "DLOAD_" + elements + "_P" + side.substr(1);
  }

  std::string deck_side_of_load(const std::string &label)
  {
    return label.size() == 2 && label[0] == 'P' && label[1] >= '1' && label[1] <= '6'
               ? "S" + label.substr(1)
               : "";
  }
} // namespace squeal
