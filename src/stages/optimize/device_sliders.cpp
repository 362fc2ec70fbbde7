#include "stages/optimize/device_sliders.hpp"

#include <algorithm>
#include <array>

namespace hexopt {

using compute::Buffer;
using compute::BufferRef;
using compute::Recorder;
namespace args = compute::args;

namespace {

// Beyond every mesh, and its square finite in f32.
constexpr double kFar = 1e18;

// Slider::freedom.
enum Freedom : std::uint32_t { kAnywhere, kPlane, kLine, kNowhere };

Freedom freedom_of(EntityKind kind, bool may_leave) {
    if (may_leave) return kAnywhere;
    return kind == EntityKind::patch ? kPlane : kind == EntityKind::curve ? kLine : kNowhere;
}

} // namespace

std::vector<std::uint8_t> DeviceSliders::find(const Problem& problem, const BoundaryModel& model) {
    std::vector<std::uint8_t> slides(problem.dof_count());
    for (std::size_t d = 0; d < slides.size(); ++d) {
        const EntityKind kind = model.associations()[problem.dof_vertex()[d]].kind;
        slides[d] = kind != EntityKind::interior && kind != EntityKind::hanging;
    }
    return slides;
}

Result<DeviceSliders> DeviceSliders::create(DeviceProblem& device, const DeviceSurface& surface,
                                            const BoundaryModel& model) {
    DeviceSliders sliders;
    sliders.device_ = &device;
    sliders.surface_ = &surface;
    sliders.model_ = &model;
    const std::vector<std::uint8_t> slides = find(*device.problem, model);
    std::vector<std::uint32_t> slider_of(slides.size(), 0);
    for (Index d = 0; d < slides.size(); ++d) {
        slider_of[d] = static_cast<std::uint32_t>(sliders.dof_.size());
        if (slides[d]) sliders.dof_.push_back(d);
    }
    sliders.last_.assign(sliders.dof_.size(), kNoIndex);
    for (std::size_t c = 0; c < device.colours.rows(); ++c) {
        for (std::uint32_t d : device.colours[c])
            if (slides[d]) sliders.by_colour_.item.push_back(slider_of[d]);
        sliders.by_colour_.offset.push_back(sliders.by_colour_.item.size());
    }
    if (auto status = sliders.allocate(); !status) return status.error();
    return sliders;
}

Status DeviceSliders::allocate() {
    const std::size_t real = device_->real_bytes(), count = dof_.size();
    struct Request {
        Buffer* buffer;
        std::size_t bytes;
        const char* label;
    };
    const Request requests[] = {
        {&slide_, 24 * count, "sliders"},
        {&limits_, 2 * count * device_->point_bytes(), "limits"},
        {&direction_, 3 * count * real, "directions"},
        {&energy_, count * real, "limit energies"},
        {&limit_gradient_, 3 * count * real, "limit gradients"},
        {&limit_block_, 6 * count * real, "limit blocks"},
    };
    for (const Request& request : requests) {
        auto buffer = device_->backend->create_buffer(std::max<std::size_t>(request.bytes, 8), request.label);
        if (!buffer) return buffer.error();
        *request.buffer = std::move(*buffer);
    }
    auto list = compute::create_array<std::uint32_t>(*device_->backend, by_colour_.item, "slider colours");
    if (!list) return list.error();
    list_ = std::move(*list);
    return Done{};
}

Status DeviceSliders::upload(const SurfaceLimits& limits, std::span<const Point> positions,
                             const Parallel& parallel) {
    if (dof_.empty()) return Done{};
    constexpr std::size_t kChunk = 256;
    const double unit = device_->frame.unit;
    std::vector<std::array<std::uint32_t, 6>> slide(dof_.size());
    std::vector<Point> range(2 * dof_.size());
    parallel.for_each(dof_.size(), kChunk, [&](std::size_t i) {
        const Index v = device_->problem->dof_vertex()[dof_[i]];
        const Association bound = model_->associations()[v];
        last_[i] = model_->project(bound, positions[v], last_[i]).element;
        const auto [first, end] = surface_->nodes(bound);
        slide[i] = {dof_[i], v,   freedom_of(bound.kind, limits.is_off_surface(v)),
                    first,   end, surface_->element_of(bound, last_[i])};
        range[2 * i] = device_->frame.to_local(limits.start.empty() ? positions[v] : limits.start[v]);
        const double band = limits.is_off_surface(v) ? limits.band[v] : 0;
        range[2 * i + 1] = Point(std::min<double>(limits.reach_of(v) / unit, kFar), band / unit, 0);
    });
    using Slides = std::span<const std::array<std::uint32_t, 6>>;
    if (auto s = device_->backend->upload(slide_, 0, std::as_bytes(Slides(slide))); !s) return s;
    return device_->write_points(limits_, range);
}

void DeviceSliders::project(Recorder& recorder, const Buffer& points) const {
    recorder.dispatch(device_->precision,
                      args::project_sliders{points.ref(), slide_.ref(), surface_->box.ref(),
                                            surface_->link.ref(), surface_->element.ref(), direction_.ref(),
                                            count()});
}

void DeviceSliders::limit(Recorder& recorder, const Buffer& points, double weight) const {
    recorder.dispatch(device_->precision,
                      args::limit_sliders{points.ref(), slide_.ref(), surface_->box.ref(),
                                          surface_->link.ref(), surface_->element.ref(), limits_.ref(),
                                          energy_.ref(), limit_gradient_.ref(), limit_block_.ref(),
                                          static_cast<float>(weight), count()});
}

void DeviceSliders::restrict_gradient(Recorder& recorder, const Buffer& gradient, const Buffer& block) const {
    recorder.dispatch(device_->precision,
                      args::restrict_sliders{slide_.ref(), direction_.ref(), limit_gradient_.ref(),
                                             limit_block_.ref(), gradient.ref(), block.ref(), count()});
}

void DeviceSliders::restrict_product(Recorder& recorder, const Buffer& step, const Buffer& product) const {
    recorder.dispatch(device_->precision,
                      args::restrict_product{slide_.ref(), direction_.ref(), limit_block_.ref(), step.ref(),
                                             product.ref(), count()});
}

void DeviceSliders::sweep_newton(Recorder& recorder, std::size_t colour, double eps, double omega,
                                 double weight) const {
    const DeviceProblem& d = *device_;
    recorder.dispatch(
        d.precision,
        args::newton_slider{d.points.ref(), d.cells.ref(), d.inverse_length.ref(), d.cell_weight.ref(),
                            d.ball_offset.ref(), d.ball_item.ref(), d.pattern.ref(), slide_.ref(),
                            list_.ref(4 * by_colour_.offset[colour]), limits_.ref(), surface_->box.ref(),
                            surface_->link.ref(), surface_->element.ref(), static_cast<float>(eps),
                            static_cast<float>(omega), static_cast<float>(weight),
                            static_cast<std::uint32_t>(by_colour_[colour].size())});
}

void DeviceSliders::sweep_raise(Recorder& recorder, std::size_t colour, BufferRef worst, BufferRef raised,
                                double margin, double gain) const {
    const DeviceProblem& d = *device_;
    recorder.dispatch(
        d.precision, args::raise_slider{d.points.ref(), d.cells.ref(), d.inverse_length.ref(),
                                        d.ball_offset.ref(), d.ball_item.ref(), d.pattern.ref(), slide_.ref(),
                                        list_.ref(4 * by_colour_.offset[colour]), limits_.ref(),
                                        surface_->box.ref(), surface_->link.ref(), surface_->element.ref(),
                                        worst, raised, static_cast<float>(margin), static_cast<float>(gain),
                                        static_cast<std::uint32_t>(by_colour_[colour].size())});
}

} // namespace hexopt
