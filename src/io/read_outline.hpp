#pragma once

#include "core/context.hpp"
#include "core/result.hpp"
#include "mesh/outline.hpp"

#include <filesystem>
#include <vector>

namespace hexopt {

/// Whether a file's name says that it holds outlines: it ends in ".dat".
bool is_outline_name(const std::filesystem::path& path);

/// Reads closed plane outlines, e.g. airfoils, from a text file of two coordinates a line: loops one after
/// the other (Selig's order or any other), or one loop as Lednicer's upper and lower side, each from the
/// nose, after a line with their counts. The first line may be a title; '#' starts a comment. Lines of 999
/// 999 (or more) separate loops; so do blank lines where what lies between them is closed (its ends no
/// farther apart than a twentieth of its diagonal); two pieces between blank lines that share both ends are
/// the two sides of one loop; else blank lines count for nothing. Points that repeat the one before (within
/// 1e-9 of the diagonal) are left out. Result: loops counter-clockwise, with `source` and `line`, one patch a
/// loop named after the file (several: STEM_1, STEM_2, ...). Errors: bad_input with file and line (not two
/// numbers, nothing enclosed, an open outline, edges that cross or touch, equal loops); cancelled.
Result<Outline> read_outlines(const std::filesystem::path& path, Context& context);

/// The points of a file that holds one loop. Errors also: bad_input where there are several.
Result<std::vector<Point2>> read_outline(const std::filesystem::path& path, Context& context);

} // namespace hexopt
