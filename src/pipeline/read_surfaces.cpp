#include "io/read_surface.hpp"
#include "pipeline/mesh_pipeline.hpp"

#include <algorithm>

namespace hexopt {

namespace {

Index patch_of(TriangleSoup& soup, const std::string& name) {
    const auto found = std::find(soup.patch_names.begin(), soup.patch_names.end(), name);
    const auto number = static_cast<Index>(found - soup.patch_names.begin());
    if (found == soup.patch_names.end()) soup.patch_names.push_back(name);
    return number;
}

void append(TriangleSoup& all, TriangleSoup part, const std::string& stem) {
    const auto first = static_cast<Index>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), part.vertices.begin(), part.vertices.end());
    std::vector<Index> number;
    for (const std::string& name : part.patch_names)
        number.push_back(patch_of(all, part.patch_names.size() == 1 ? stem : stem + "." + name));
    if (part.patch.empty()) {
        number.assign(1, patch_of(all, stem));
        part.patch.assign(part.triangles.size(), 0);
    }
    for (auto p = static_cast<Index>(all.patch_group.size()); p < all.patch_names.size(); ++p)
        all.patch_group.push_back(p);
    for (Index p = 0; p < number.size(); ++p) all.patch_group[number[p]] = number[part.group_of(p)];
    for (std::size_t t = 0; t < part.triangles.size(); ++t) {
        const auto& [a, b, c] = part.triangles[t];
        all.triangles.push_back({first + a, first + b, first + c});
        all.patch.push_back(number[part.patch[t]]);
    }
}

} // namespace

Result<TriangleSoup> read_surfaces(const std::vector<std::filesystem::path>& paths,
                                   const TessellationOptions& tessellation, Context& context) {
    if (paths.size() == 1) return read_surface(paths.front(), tessellation, context);
    TriangleSoup all;
    for (const std::filesystem::path& path : paths) {
        Result<TriangleSoup> part = read_surface(path, tessellation, context);
        if (!part) return part;
        append(all, std::move(*part), path.stem().string());
    }
    return all;
}

} // namespace hexopt
