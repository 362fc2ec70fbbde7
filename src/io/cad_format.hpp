#pragma once

#include "io/read_cad.hpp"

#include <string_view>

/// What a CAD file is and whether it is whole, told without OpenCASCADE, whose readers trust the counts in a
/// file and read on where one was cut short.
namespace hexopt::io_detail {

enum class CadFormat { none, step, iges, brep };

/// By content, else by name (.step, .stp, .iges, .igs, .brep, .brp).
CadFormat recognise_cad(const std::string& file, std::string_view bytes);

/// Errors: bad_input where the file is of another format than its name says, not complete, or holds counts
/// that it is too short for.
Status check_cad(CadFormat format, const std::string& file, std::string_view bytes);
Status check_step(const std::string& file, std::string_view bytes);
Status check_iges(const std::string& file, std::string_view bytes);
Status check_brep(const std::string& file, std::string_view bytes);

bool looks_like_step(std::string_view bytes);
bool looks_like_iges(std::string_view bytes);
bool looks_like_brep(std::string_view bytes);

/// read_cad() of a file that is in memory already.
Result<CadSurface> read_cad_bytes(const std::string& file, std::string_view bytes,
                                  const TessellationOptions& options, const Context& context);

} // namespace hexopt::io_detail
