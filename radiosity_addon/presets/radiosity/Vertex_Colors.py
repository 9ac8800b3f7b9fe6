import bpy

radiosity = bpy.context.scene.radiosity

radiosity.target = 'VERTEX'
radiosity.domain = 'CORNER'
radiosity.quality = 'MEDIUM'
radiosity.passes = {'EMIT', 'DIRECT', 'INDIRECT', 'COLOR'}
