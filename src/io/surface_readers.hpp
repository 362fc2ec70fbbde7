#pragma once

#include "core/context.hpp"
#include "io/read_cad.hpp"
#include "io/scanner.hpp"
#include "mesh/triangle_soup.hpp"

#include <map>
#include <span>

/// One reader a format. Each fills the soup from the whole file in memory; on false the scanner holds the
/// error. Coordinates and the range of ids are checked afterwards by read_surface().
namespace hexopt::io_detail {

/// read_surface() of a file that is in memory already.
Result<TriangleSoup> read_surface_bytes(const std::string& file, std::string_view bytes,
                                        const Context& context, const TessellationOptions& tessellation = {});

/// What a surface reader collects.
struct SurfaceBuilder {
    explicit SurfaceBuilder(const Context& lent) : context(lent) {}

    /// Number of the patch with this name; added where it is new.
    Index patch_of(const std::string& name);
    /// Cuts a polygon of at least three vertices into triangles around its first vertex.
    void add_polygon(std::span<const Index> ids);

    const Context& context;
    TriangleSoup soup; ///< patch has one entry a triangle
    Index patch = 0;   ///< of the next triangles

  private:
    std::map<std::string, Index> patch_number_;
};

bool looks_like_binary_stl(std::string_view bytes);
bool looks_like_ascii_stl(std::string_view bytes);
bool read_binary_stl(Scanner& scanner, SurfaceBuilder& builder);
bool read_ascii_stl(Scanner& scanner, SurfaceBuilder& builder);

bool looks_like_obj(std::string_view bytes);
bool read_obj(Scanner& scanner, SurfaceBuilder& builder);

bool looks_like_off(std::string_view bytes);
bool read_off(Scanner& scanner, SurfaceBuilder& builder);

bool looks_like_ply(std::string_view bytes);
bool read_ply(Scanner& scanner, SurfaceBuilder& builder);

/// True for every XML file of VTK; one of another type is an error that says so.
bool looks_like_vtp(std::string_view bytes);
bool read_vtp(Scanner& scanner, SurfaceBuilder& builder);

/// An id of the file as an Index; false with an error where it is negative or too large.
bool take_id(Scanner& scanner, std::int64_t value, Index& id);

} // namespace hexopt::io_detail
