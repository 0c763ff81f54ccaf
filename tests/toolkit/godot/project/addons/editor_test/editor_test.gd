# In the editor: how a scene's options are shown; then the library is loaded again, and the scene keeps what was set.
@tool
extends EditorPlugin

func _enter_tree() -> void:
	run.call_deferred()

func run() -> void:
	for _k in 5:
		await get_tree().process_frame
	# Without the types of the library, so that it can be unloaded.
	var scene := ClassDB.instantiate("PalpateScene") as Node3D
	scene.inputs = ["molecule"]
	scene.gpu = "none"
	add_child(scene)
	scene.max_force_n = 2.5
	await get_tree().process_frame
	var closed: bool = not scene.is_open()
	scene.preview = true
	await scene.opened
	var rows := {}
	for property in scene.get_property_list():
		rows[property.name] = [property.hint, property.hint_string, property.usage]
	var reloaded := GDExtensionManager.reload_extension("res://addons/palpate/palpate.gdextension")
	await scene.opened
	print("RESULT ", JSON.stringify({"rows": rows, "closed": closed, "reloaded": reloaded, "kept": scene.max_force_n, "is_open": scene.is_open()}))
	get_tree().quit()
