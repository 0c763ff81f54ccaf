# Scenes that come and go, in every state: opened, still opening, replaced by another scene of the engine. User arguments: number of cycles, gpu.
extends SceneTree

var said := {"opened": 0, "kb": []}

func _initialize() -> void:
	run.call_deferred()

func memory_kb() -> int:
	var output := []
	OS.execute("ps", ["-o", "rss=", "-p", str(OS.get_process_id())], output)
	return int(output[0])

func run() -> void:
	var arguments := OS.get_cmdline_user_args()
	for k in int(arguments[0]):
		var scene := PalpateScene.new()
		scene.inputs = ["molecule"]
		scene.gpu = arguments[1]
		scene.black_box = "off"
		scene.real_time = false
		scene.add_child(PalpateHand.new())
		scene.add_child(PalpateVolume.new())
		# A packed scene of three nodes, without a script, as the editor saves it.
		for child in scene.get_children():
			child.owner = scene
		var packed := PackedScene.new()
		packed.pack(scene)
		scene.free()
		change_scene_to_packed(packed)
		await scene_changed
		if k % 5 != 4:
			await current_scene.opened
			said.opened += 1
			for _k in 3:
				await process_frame
		if k % 10 == 9:
			said.kb.append(memory_kb())
	# The last one is still there when the engine ends.
	print("RESULT ", JSON.stringify(said))
	quit()
