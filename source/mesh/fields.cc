#include <squeal/base/files.h>
#include <squeal/mesh/fields.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/data_out_base.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_system.h>
#include <deal.II/numerics/data_out.h>

#include <cmath>
#include <cstdio>

namespace squeal
{
  using namespace dealii;

  std::string write_pieces(
      const std::string &directory, const std::string &base, const MPI_Comm comm,
      const std::function<void(std::ostream &)> &write_vtu,
      const std::function<void(std::ostream &, const std::vector<std::string> &)> &write_pvtu)
  {
    const unsigned int rank = Utilities::MPI::this_mpi_process(comm);
    const unsigned int n    = Utilities::MPI::n_mpi_processes(comm);
    const auto piece        = [&](const unsigned int r)
    { return n == 1 ? base + ".vtu" : base + "." + std::to_string(r) + ".vtu"; };
    std::vector<std::string> pieces, files;
    for (unsigned int r = 0; r < n; ++r)
    {
      pieces.push_back(piece(r));
      files.push_back(directory + "/" + pieces.back());
    }
    // Before the other ranks write theirs, which the first one is answerable for.
    announce_files(files);
    MPI_Barrier(comm);
    write_file(files[rank], write_vtu);
    const std::string record = base + ".pvtu";
    if (rank == 0)
      write_file(directory + "/" + record, [&](std::ostream &pvtu) { write_pvtu(pvtu, pieces); });
    return record;
  }

  namespace
  {
    using Vector = LinearAlgebra::distributed::Vector<double>;

    /// Turns columns of unknowns into finite-element fields and writes them.
    template <int dim>
    class FieldWriter
    {
    public:
      explicit FieldWriter(const FiniteElementSpace<dim> &spaces)
          : spaces(spaces), vector_fe(spaces.fe, dim), vector_nodes(spaces.triangulation)
      {
        vector_nodes.distribute_dofs(vector_fe);
        body.reinit(spaces.triangulation.n_active_cells());
        for (const auto &cell : spaces.triangulation.active_cell_iterators())
          if (cell->is_locally_owned())
            body(cell->active_cell_index()) = spaces.geometry.parts[cell->material_id()].body;
      }

      /// The displacement field of a column.
      Vector displacement(const double *column) const
      {
        std::vector<Vector> components;
        for (unsigned int c = 0; c < dim; ++c)
          components.push_back(nodal_field(
              column, spaces.hanging, [&](const auto node) { return spaces.equation(node, c); }));

        IndexSet relevant;
        DoFTools::extract_locally_relevant_dofs(vector_nodes, relevant);
        Vector field(vector_nodes.locally_owned_dofs(), relevant, spaces.comm);
        std::vector<types::global_dof_index> scalar_dofs(spaces.fe.n_dofs_per_cell()),
            vector_dofs(vector_fe.n_dofs_per_cell());
        for (const auto &cell : vector_nodes.active_cell_iterators())
          if (cell->is_locally_owned())
          {
            const typename DoFHandler<dim>::active_cell_iterator scalar_cell(
                &spaces.triangulation, cell->level(), cell->index(), &spaces.nodes);
            cell->get_dof_indices(vector_dofs);
            scalar_cell->get_dof_indices(scalar_dofs);
            for (unsigned int i = 0; i < vector_dofs.size(); ++i)
              if (vector_nodes.locally_owned_dofs().is_element(vector_dofs[i]))
              {
                const auto [component, base] = vector_fe.system_to_component_index(i);
                field(vector_dofs[i])        = components[component](scalar_dofs[base]);
              }
          }
        field.update_ghost_values();
        return field;
      }

      /// The multiplier field of a column times a factor.
      Vector pressure(const double *column, const double factor) const
      {
        Vector field = nodal_field(column, spaces.lines_of(dim),
                                   [&](const auto node) { return spaces.multiplier(node); });
        field *= factor;
        field.update_ghost_values();
        return field;
      }

      /// Writes <base>.pvtu with one .vtu per rank.
      std::string write(const std::vector<std::pair<std::string, const Vector *>> &displacements,
                        const std::vector<std::pair<std::string, const Vector *>> &pressures,
                        const std::string &directory, const std::string &base,
                        const double time) const
      {
        DataOut<dim> data_out;
        DataOutBase::VtkFlags flags;
        flags.compression_level = DataOutBase::VtkFlags::best_speed;
        flags.time              = time;
        data_out.set_flags(flags);
        data_out.attach_triangulation(spaces.triangulation);
        const std::vector<DataComponentInterpretation::DataComponentInterpretation> is_vector(
            dim, DataComponentInterpretation::component_is_part_of_vector);
        for (const auto &[name, field] : displacements)
          data_out.add_data_vector(vector_nodes, *field, std::vector<std::string>(dim, name),
                                   is_vector);
        for (const auto &[name, field] : pressures)
          data_out.add_data_vector(spaces.nodes, *field, name);
        data_out.add_data_vector(body, "body");
        data_out.build_patches(spaces.mapping, spaces.fe.degree, DataOut<dim>::curved_inner_cells);

        return write_pieces(
            directory, base, spaces.comm, [&](std::ostream &out) { data_out.write_vtu(out); },
            [&](std::ostream &out, const std::vector<std::string> &pieces)
            { data_out.write_pvtu_record(out, pieces); });
      }

    private:
      template <typename Equation>
      Vector nodal_field(const double *column, const AffineConstraints<double> &lines,
                         const Equation &equation) const
      {
        Vector field(spaces.nodes.locally_owned_dofs(), spaces.relevant_nodes, spaces.comm);
        for (const auto node : spaces.nodes.locally_owned_dofs())
          if (equation(node) != FiniteElementSpace<dim>::none)
            field(node) = column[equation(node) - spaces.rows.begin];
        lines.distribute(field);
        field.update_ghost_values();
        return field;
      }

      const FiniteElementSpace<dim> &spaces;
      const FESystem<dim> vector_fe;
      DoFHandler<dim> vector_nodes;
      dealii::Vector<float> body;
    };

    void write_pvd(const std::string &filename,
                   const std::vector<std::pair<double, std::string>> &records, const MPI_Comm comm)
    {
      if (Utilities::MPI::this_mpi_process(comm) != 0)
        return;
      write_file(filename, [&](std::ostream &out) { DataOutBase::write_pvd_record(out, records); });
    }

  } // namespace

  std::string mode_file(const unsigned int cycle, const unsigned int mode)
  {
    return "mode-" + std::to_string(cycle) + "-" + Utilities::int_to_string(mode, 3);
  }

  std::string frames_directory()
  {
    return "frames";
  }

  template <int dim>
  void write_state(const FiniteElementSpace<dim> &spaces, const MultiVector &state,
                   const double pressure_scale, const std::string &directory,
                   const unsigned int cycle)
  {
    const FieldWriter<dim> writer(spaces);
    const Vector u = writer.displacement(state.column(0));
    Vector p;
    std::vector<std::pair<std::string, const Vector *>> pressures;
    if (spaces.n_multipliers > 0)
    {
      p = writer.pressure(state.column(0), pressure_scale);
      pressures.emplace_back("contact_pressure_pa", &p);
    }
    const std::string base = "state-" + std::to_string(cycle);
    const std::string record =
        writer.write({{"displacement_m", &u}}, pressures, directory, base, 0);
    write_pvd(directory + "/" + base + ".pvd", {{0., record}}, spaces.comm);
  }

  template <int dim>
  void write_mode(const FiniteElementSpace<dim> &spaces, const ComplexMultiVector &modes,
                  const unsigned int column, const double pressure_scale,
                  const std::string &directory, const unsigned int cycle, const unsigned int mode,
                  const unsigned int n_frames)
  {
    const FieldWriter<dim> writer(spaces);
    Vector u_re       = writer.displacement(modes.re.column(column));
    Vector u_im       = writer.displacement(modes.im.column(column));
    const double size = std::max(u_re.linfty_norm(), u_im.linfty_norm());
    u_re /= size;
    u_im /= size;
    u_re.update_ghost_values();
    u_im.update_ghost_values();

    Vector p_re, p_im;
    std::vector<std::pair<std::string, const Vector *>> pressures;
    if (spaces.n_multipliers > 0)
    {
      p_re      = writer.pressure(modes.re.column(column), pressure_scale / size);
      p_im      = writer.pressure(modes.im.column(column), pressure_scale / size);
      pressures = {{"contact_pressure_re_pa", &p_re}, {"contact_pressure_im_pa", &p_im}};
    }
    const std::string base = mode_file(cycle, mode);
    writer.write({{"displacement_re_m", &u_re}, {"displacement_im_m", &u_im}}, pressures, directory,
                 base, 0);

    if (n_frames == 0)
      return;
    const std::string frames = directory + "/" + frames_directory();
    if (Utilities::MPI::this_mpi_process(spaces.comm) == 0)
      make_directory(frames);
    MPI_Barrier(spaces.comm);
    // Re[u exp(i omega t)] = Re u cos(omega t) - Im u sin(omega t)
    std::vector<std::pair<double, std::string>> records;
    for (unsigned int frame = 0; frame < n_frames; ++frame)
    {
      const double time = double(frame) / n_frames, angle = 2 * numbers::PI * time;
      Vector u = u_re;
      u *= std::cos(angle);
      u.add(-std::sin(angle), u_im);
      u.update_ghost_values();
      records.emplace_back(
          time, frames_directory() + "/" +
                    writer.write({{"displacement_m", &u}}, {}, frames,
                                 base + "-frame-" + Utilities::int_to_string(frame, 3), time));
    }
    write_pvd(directory + "/" + base + ".pvd", records, spaces.comm);
  }

  template void write_state<3>(const FiniteElementSpace<3> &, const MultiVector &, double,
                               const std::string &, unsigned int);
  template void write_mode<3>(const FiniteElementSpace<3> &, const ComplexMultiVector &,
                              unsigned int, double, const std::string &, unsigned int, unsigned int,
                              unsigned int);

  template void write_state<2>(const FiniteElementSpace<2> &, const MultiVector &, double,
                               const std::string &, unsigned int);
  template void write_mode<2>(const FiniteElementSpace<2> &, const ComplexMultiVector &,
                              unsigned int, double, const std::string &, unsigned int, unsigned int,
                              unsigned int);
} // namespace squeal
