#include "command.hpp"
#include "compute/device_choice.hpp"

#include <fmt/format.h>

namespace hexopt::cli {

namespace {

using namespace hexopt::compute;

std::string describe(const VulkanDeviceInfo& device) {
    const Capabilities& c = device.capabilities;
    std::string line = fmt::format("{}: {} ({})", device.index, c.name, name_of(c.type));
    if (!c.driver.empty()) line += ", " + c.driver;
    if (c.memory_bytes > 0)
        line += fmt::format(", {:.1f} GiB", static_cast<double>(c.memory_bytes) / (1 << 30));
    if (!device.missing.empty()) return line + ", cannot be used: lacks " + device.missing;
    return line + (c.f64 ? ", f32 f64 mixed" : ", f32 only");
}

void run(Session& session) {
    session.say("cpu: the host's vectorised code, f32 f64 mixed");
    auto devices = list_vulkan_devices();
    if (!devices)
        session.say("vulkan: " + devices.error().reasons.back());
    else
        for (const VulkanDeviceInfo& device : *devices) session.say(describe(device));
    const Error* absent = devices ? nullptr : &devices.error();
    const auto choice =
        choose_device("auto", Precision::f64, devices ? *devices : std::vector<VulkanDeviceInfo>{}, absent);
    if (!choice) return session.fail(choice.error());
    session.say("picked by default: " + choice->reason);
}

} // namespace

void add_devices(CLI::App& app, Session& session) {
    CLI::App* command =
        app.add_subcommand("devices", "List the devices that can compute, and which would be picked");
    session.add_common_options(*command);
    command->callback([&session] { run(session); });
}

} // namespace hexopt::cli
