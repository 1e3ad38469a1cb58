#pragma once

#include <squeal/equations/eigenproblem.h>
#include <squeal/linalg/complex_multi_vector.h>
#include <squeal/projection/search_space.h>
#include <squeal/projection/small_problem.h>

#include <functional>
#include <optional>

namespace squeal
{
  /// Right vectors, Q(l) x = 0, or left ones, Q(l)^T y = 0.
  enum class Side
  {
    right,
    left
  };
  inline Side opposite(const Side side)
  {
    return side == Side::right ? Side::left : Side::right;
  }

  /// Columns for the two bases; a method with one basis leaves the left ones empty.
  struct BothSides
  {
    MultiVector right, left;
    MultiVector &operator[](const Side side)
    {
      return side == Side::right ? right : left;
    }
  };

  /// What a method brings to Davidson. Thresholds differ from method to method on purpose.
  struct DavidsonMethod
  {
    /// What columns must add to a basis to be taken into it.
    Novelty novelty = {1e-10};
    /// Corrections after which run() gives up.
    unsigned int most_steps = 0;
    /// Moves columns to where they satisfy the constraints of a side, or clears the contact
    /// pressures, which are no part of a basis.
    std::function<void(MultiVector &, Side)> constrain;
    /// Columns for @p side that belong to new ones of the other side, as F^{-T} M v belongs to v.
    /// With one basis U they are its test vectors Z; empty: Z = U, Galerkin's method. With two
    /// bases they fill the one that has grown less.
    std::function<MultiVector(const MultiVector &others, Side side)> partners;
    /// r := Pi^T r. If it is given, the test vectors Z = Pi U are not kept but made of U.
    std::function<void(MultiVector &)> relieve;
    /// Left vectors have corrections and an orthonormal basis of their own.
    bool has_two_bases = false;
    /// U^T M U is kept, too.
    bool measures = false;
  };

  /// Davidson's method in blocks and in real arithmetic, for right vectors out of a basis V and
  /// left ones out of W: the bases, the projected problem
  ///     W^T (l^2 M + l P + Q + sum h(l) A) V c = 0,
  /// and the loop. In each step a method takes pairs of that small problem, corrects what is not
  /// accurate (Morgan and Scott, SIAM J. Sci. Stat. Comput. 7 (1986) 817: any approximate inverse
  /// times the residual), and both bases grow by what is new in the corrections. Only the new rows
  /// and columns of the projected matrices are computed; images of the bases are not kept.
  ///
  /// V is orthonormal. W is, by the method, V itself (Galerkin), made of V's columns (partners), or
  /// a basis of its own. With two bases what is new in V may have nothing to do with what is new
  /// in W, and each side must have as many columns: see expand().
  class Davidson
  {
  public:
    /// The problem must outlive this.
    Davidson(const QuadraticEigenproblem &problem, DavidsonMethod method);

    /// Takes columns into the bases that satisfy the constraints of their side. With two bases the
    /// one that has grown less is filled with partners of the other's new columns; if these are
    /// known already, what the smaller side sees least is dropped from the larger. Collective.
    void expand(BothSides columns);
    /// Begins anew with other columns.
    void restart(BothSides columns);
    /// V := V C, Z := Z C with orthonormal columns of C. For one basis.
    void turn(const DenseMatrix &c);
    /// From now on partners of the columns that came last are added, too, at twice the price: where
    /// spaces grow in vain, W^T Q V may be nearly singular.
    void add_partners()
    {
      adds_partners = true;
    }

    /// correct(step) gives corrections of what is not accurate, which enlarge the bases, or nothing
    /// at the end. Returns false if all steps are spent.
    bool run(const std::function<std::optional<BothSides>(unsigned int step)> &correct);

    unsigned int n_columns() const
    {
      return right.n_columns();
    }
    const SmallProblem &projected() const
    {
      return small;
    }
    /// V^T M V, if the method measures.
    const DenseMatrix &mass() const
    {
      return mass_;
    }
    /// V c or W d of coordinates in the present bases, or in the bases of before.
    ComplexMultiVector vectors(ComplexDenseMatrix coordinates, Side side) const;
    /// The coordinates of vectors in an orthonormal basis that contains them. Collective.
    ComplexDenseMatrix coordinates(const ComplexMultiVector &vectors, Side side) const;

  private:
    bool keeps_tests() const
    {
      return method.partners && !method.relieve && !method.has_two_bases;
    }
    /// W, or V if Pi V is not kept.
    const MultiVector &tests() const
    {
      return method.has_two_bases ? left.basis() : keeps_tests() ? kept_tests : right.basis();
    }
    /// Adds what is new in the columns to a basis and appends it to those added.
    void add(MultiVector columns, Side side, BothSides &added);
    /// Makes as many new columns on both sides.
    void balance(BothSides &added);
    /// Keeps as many combinations of a side's last columns as the other side has: the ones with the
    /// largest products with M and the others.
    void keep_what_is_seen(Side side, BothSides &added);
    /// The new rows and columns of the projected matrices, for new columns v and w.
    void project(const MultiVector &v, const MultiVector &w);

    const QuadraticEigenproblem &problem;
    const DavidsonMethod method;
    SearchSpace right, left; ///< V, and W if there are two bases
    MultiVector kept_tests;  ///< Z
    SmallProblem small;
    DenseMatrix mass_;
    bool adds_partners = false;
    BothSides newest; ///< with two bases
  };

  /// Finds the turns of complex columns. Collective.
  std::vector<MainPart> main_parts(const ComplexMultiVector &vectors);
} // namespace squeal
