#include "compute/backend.hpp"

#include <cassert>

namespace hexopt::compute {

const char* name_of(DeviceType type) {
    constexpr const char* kNames[] = {"discrete GPU", "integrated GPU", "virtual GPU",
                                      "software GPU", "other",          "host"};
    return kNames[static_cast<int>(type)];
}

void Recorder::copy(BufferRef source, BufferRef target, std::size_t bytes) {
    assert(bytes % 4 == 0);
    Command command;
    command.kind = Command::Kind::copy;
    command.source = source;
    command.target = target;
    command.bytes = bytes;
    commands_.push_back(command);
}

void Recorder::fill(BufferRef target, std::uint32_t value, std::size_t bytes) {
    assert(bytes % 4 == 0);
    Command command;
    command.kind = Command::Kind::fill;
    command.target = target;
    command.bytes = bytes;
    command.value = value;
    commands_.push_back(command);
}

} // namespace hexopt::compute
