#include "samples/geometry/geometries.hpp"

#include "samples/geometry/makers.hpp"

#include <algorithm>
#include <array>

namespace hexopt {

namespace {

using Maker = Result<TriangleSoup> (*)(const GeometryOptions&, Context&);

struct Geometry {
    GeometryInfo info;
    std::string_view airfoil; ///< default
    Maker make;
};

constexpr std::array<Geometry, 13> kGeometries = {{
    {{"cylinder", "straight pipe", 48, false}, "", geometry::make_cylinder},
    {{"three-pipe-joint", "three pipes of different width that meet in a ball", 48, false},
     "",
     geometry::make_three_pipe_joint},
    {{"volute", "spiral casing of a pump with inlet and outlet pipes", 48, false}, "", geometry::make_volute},
    {{"missile", "missile with fins and canards in a box", 48, false}, "", geometry::make_missile},
    {{"ahmed", "Ahmed body, 25 degrees, on its legs in a wind tunnel", 64, false}, "", geometry::make_ahmed},
    {{"wing", "half of a swept wing with a sharp trailing edge in a box", 64, true},
     "2412",
     geometry::make_wing},
    {{"business-jet", "half of a jet with cruciform tail and nacelle in a box", 64, false},
     "",
     geometry::make_business_jet},
    {{"wing-body", "half of an airliner's wing, body, pylon and open nacelle in a box", 64, false},
     "",
     geometry::make_wing_body},
    {{"front-wing", "half of a racing car's front wing and nose over the ground", 48, false},
     "",
     geometry::make_front_wing},
    {{"airfoil", "flow past an airfoil, a slab a fiftieth of the chord thick", 96, true},
     "0012",
     geometry::make_airfoil_slab},
    {{"multi-element", "flow past an airfoil with slat and flap, a thin slab", 120, false},
     "",
     geometry::make_multi_element_slab},
    {{"cooled-blade", "slab of a turbine blade with seven cooling passages", 48, false},
     "",
     geometry::make_cooled_blade},
    {{"tire-gap", "air between the road and a grooved tire", 240, false}, "", geometry::make_tire_gap},
}};

Error usage_error(std::string reason) {
    return make_error(ErrorCode::usage, "sample", "", std::move(reason));
}

const Geometry* find(std::string_view name) {
    const auto found = std::find_if(kGeometries.begin(), kGeometries.end(),
                                    [&](const Geometry& g) { return g.info.name == name; });
    return found == kGeometries.end() ? nullptr : &*found;
}

} // namespace

const std::vector<GeometryInfo>& geometry_infos() {
    static const std::vector<GeometryInfo> infos = [] {
        std::vector<GeometryInfo> all;
        for (const Geometry& geometry : kGeometries) all.push_back(geometry.info);
        return all;
    }();
    return infos;
}

std::vector<std::string> geometry_names() {
    std::vector<std::string> names;
    for (const Geometry& geometry : kGeometries) names.emplace_back(geometry.info.name);
    return names;
}

bool is_geometry_name(std::string_view name) { return find(name) != nullptr; }

Result<TriangleSoup> make_geometry(std::string_view name, const GeometryOptions& options, Context& context) {
    const Geometry* geometry = find(name);
    if (!geometry) {
        std::string known;
        for (const std::string& other : geometry_names()) known += (known.empty() ? "" : ", ") + other;
        return usage_error("unknown geometry '" + std::string(name) + "'; known: " + known);
    }
    if (options.size != 0 && (options.size < 12 || options.size > 720))
        return usage_error("the size of a geometry must lie in 12..720 segments");
    if (!options.airfoil.empty() && !geometry->info.takes_airfoil)
        return usage_error("the geometry '" + std::string(name) + "' takes no airfoil");
    GeometryOptions filled = options;
    if (filled.size == 0) filled.size = geometry->info.default_size;
    if (filled.airfoil.empty()) filled.airfoil = geometry->airfoil;
    return geometry->make(filled, context);
}

} // namespace hexopt
