# A hand on a force device, until the engine is killed. User argument: the device.
extends SceneTree

func _initialize() -> void:
	var scene := PalpateScene.new()
	var hand := PalpateHand.new()
	scene.inputs = ["shell"]
	scene.gpu = "none"
	scene.black_box = "off"
	scene.device = OS.get_cmdline_user_args()[0]
	scene.watchdog_s = 1.0
	scene.real_time = false
	hand.follows_device = true
	scene.add_child(hand)
	scene.failed.connect(func(sentence): print(sentence); quit(1))
	root.add_child(scene)
