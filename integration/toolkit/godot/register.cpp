#include "nodes.h"

using namespace palpate::godot;

namespace {

void for_each_class(void (*act)(const ClassRow& row)) {
  for (const auto& row : {&SceneNode::class_row, &HandNode::class_row, &VolumeNode::class_row})
    act(row());
}

void initialise(void*, GDExtensionInitializationLevel level) {
  if (level == GDEXTENSION_INITIALIZATION_SCENE) for_each_class(register_class);
  if (level == GDEXTENSION_INITIALIZATION_EDITOR) for_each_class(load_help);
}

void end(void*, GDExtensionInitializationLevel level) {
  if (level == GDEXTENSION_INITIALIZATION_SCENE) for_each_class(unregister_class);
}

}  // namespace

/// What palpate.gdextension names.
extern "C" __attribute__((visibility("default"))) GDExtensionBool palpate_godot_init(
    GDExtensionInterfaceGetProcAddress find, GDExtensionClassLibraryPtr library,
    GDExtensionInitialization* initialization) {
  if (!load_functions(find, library)) return false;
  initialization->minimum_initialization_level = GDEXTENSION_INITIALIZATION_SCENE;
  initialization->userdata = nullptr;
  initialization->initialize = initialise;
  initialization->deinitialize = end;
  return true;
}
